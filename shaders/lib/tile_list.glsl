// Records of what tiles can meet (shaders/shared/tile_list.h). Needs shaders/lib/bvh.glsl.
//
// Variants: HALFLIGHT_TILE_RAYS, HALFLIGHT_TILE_ENTRIES (numbers).
#include "shaders/shared/tile_list.h"

layout(binding = UNIT_FREE + 1) uniform usamplerBuffer tile_lists;

#ifdef HALFLIGHT_NODES_FLOAT
const int kBoxTexels = kTileFloatBoxTexels;
#else
const int kBoxTexels = kTileBoxTexels;
#endif
#ifdef HALFLIGHT_TWO_LEVEL
const int kEntryTexels = kBoxTexels * kTileInstanceBoxes;
#else
const int kEntryTexels = kBoxTexels * kTileBoxes;
#endif
const int kTileRecord = kTileHeaderTexels + kTileEntries * kEntryTexels;

struct TileEntry {
    uvec4 texels[kEntryTexels];
};

const int kEntryBox = 0;  // the boxes of an entry, with: reference
#ifdef HALFLIGHT_TWO_LEVEL
const int kInstanceBox = kBoxTexels;   // instance
const int kBlockBox = 2 * kBoxTexels;  // head; only leaves have it
const int kNodeTexels = kBlockBox;
#else
const int kNodeTexels = kEntryTexels;
#endif

uint box_word(TileEntry e, const int box) { return e.texels[box].w; }
uint entry_reference(TileEntry e) { return box_word(e, kEntryBox); }

vec3 box_lower(TileEntry e, const int box) {
#ifdef HALFLIGHT_NODES_FLOAT
    return uintBitsToFloat(e.texels[box].xyz);
#else
    return vec3(ivec3(e.texels[box].xyz & 0xffffu));
#endif
}

vec3 box_upper(TileEntry e, const int box) {
#ifdef HALFLIGHT_NODES_FLOAT
    return uintBitsToFloat(e.texels[box + 1].xyz);
#else
    return vec3(ivec3(e.texels[box].xyz >> 16));
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
