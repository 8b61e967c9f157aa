// Records of what tiles can meet (shaders/shared/tile_list.h). Needs shaders/lib/bvh.glsl.
//
// Variants: HALFLIGHT_TILE_RAYS, HALFLIGHT_TILE_ENTRIES (numbers).
#include "shaders/shared/tile_list.h"

layout(binding = UNIT_FREE + 1) uniform usamplerBuffer tile_lists;

#ifdef HALFLIGHT_NODES_FLOAT
const int kEntryTexels = kTileFloatEntryTexels;
#else
const int kEntryTexels = kTileEntryTexels;
#endif
const int kTileRecord = kTileHeaderTexels + kTileEntries * kEntryTexels;

struct TileEntry {
    uvec4 texels[kEntryTexels];
};

uint entry_reference(TileEntry e) { return e.texels[0].w; }

vec3 entry_lower(TileEntry e) {
#ifdef HALFLIGHT_NODES_FLOAT
    return uintBitsToFloat(e.texels[0].xyz);
#else
    return vec3(ivec3(e.texels[0].xyz & 0xffffu));
#endif
}

vec3 entry_upper(TileEntry e) {
#ifdef HALFLIGHT_NODES_FLOAT
    return uintBitsToFloat(e.texels[1].xyz);
#else
    return vec3(ivec3(e.texels[0].xyz >> 16));
#endif
}

int entry_texel(uint tile, int index) { return int(tile) * kTileRecord + kTileHeaderTexels + index * kEntryTexels; }

TileEntry load_entry(uint tile, int index) {
    TileEntry e;
    for (int i = 0; i < kEntryTexels; ++i) e.texels[i] = texelFetch(tile_lists, entry_texel(tile, index) + i);
    return e;
}

// The first `leaves` entries and the last `others`.
struct TileCounts {
    int leaves;
    int others;
};

TileCounts tile_counts(uint word) { return TileCounts(int(word & 0xffffu), int(word >> 16)); }

TileCounts load_counts(uint tile) { return tile_counts(texelFetch(tile_lists, int(tile) * kTileRecord + 1).w); }

// count <= kTileEntries.
uint lowest_bits(int count) { return count >= 32 ? 0xffffffffu : (1u << count) - 1u; }
uint leaf_bits(TileCounts c) { return lowest_bits(c.leaves); }
uint other_bits(TileCounts c) { return ~lowest_bits(kTileEntries - c.others); }
