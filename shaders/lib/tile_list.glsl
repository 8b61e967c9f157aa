// Records of the nodes that tiles can meet (shaders/shared/tile_list.h). Needs shaders/lib/bvh.glsl.
#include "shaders/lib/node_format.glsl"
#include "shaders/shared/tile_list.h"

uniform usamplerBuffer tile_lists;

const int kTileRays = HALFLIGHT_TILE_RAYS;        // consecutive slots that share a list
const int kTileEntries = HALFLIGHT_TILE_ENTRIES;  // maximum number of entries of a list

const int kBoxTexels = kFloatNodes ? kTileFloatBoxTexels : kTileBoxTexels;
const int kEntryTexels = kBoxTexels * (kTwoLevel ? kTileInstanceBoxes : kTileBoxes);
const int kTileRecord = kTileHeaderTexels + kTileEntries * kEntryTexels;

struct TileEntry {
    uvec4 texels[kEntryTexels];
};

// First texels of the boxes of an entry.
const int kEntryBox = 0;                                // the word of this box is the reference
const int kInstanceBox = kTwoLevel ? kBoxTexels : 0;    // the word of this box is the instance
const int kBlockBox = kTwoLevel ? 2 * kBoxTexels : 0;   // the word of this box is the block's head; leaves only
const int kNodeTexels = kTwoLevel ? kBlockBox : kEntryTexels;

uint box_word(TileEntry e, const int box) { return e.texels[box].w; }
uint entry_reference(TileEntry e) { return box_word(e, kEntryBox); }

vec3 box_lower(TileEntry e, const int box) {
    if (kFloatNodes) return uintBitsToFloat(e.texels[box].xyz);
    return vec3(ivec3(e.texels[box].xyz & 0xffffu));
}

vec3 box_upper(TileEntry e, const int box) {
    if (kFloatNodes) return uintBitsToFloat(e.texels[box + kBoxTexels - 1].xyz);
    return vec3(ivec3(e.texels[box].xyz >> 16));
}

int entry_texel(uint tile, int index) { return int(tile) * kTileRecord + kTileHeaderTexels + index * kEntryTexels; }

TileEntry load_entry(uint tile, int index) {
    TileEntry e;
    for (int i = 0; i < kEntryTexels; ++i) e.texels[i] = texelFetch(tile_lists, entry_texel(tile, index) + i);
    return e;
}

// Numbers of leaves, which come first in a list, and of others, which come last.
struct TileCounts {
    int leaves;
    int others;
};

TileCounts tile_counts(uint word) { return TileCounts(int(word & 0xffffu), int(word >> 16)); }

TileCounts load_counts(uint tile) { return tile_counts(texelFetch(tile_lists, int(tile) * kTileRecord + 1).w); }

// Sets of a list's entries: one bit each.
uint lowest_word_bits(int count) { return count >= kTileMaskBits ? 0xffffffffu : (1u << max(count, 0)) - 1u; }

#if HALFLIGHT_TILE_ENTRIES > 32
#define EntryMask uvec2
const EntryMask kNoEntries = uvec2(0u);
bool any_entry(EntryMask m) { return (m.x | m.y) != 0u; }
int first_entry(EntryMask m) { return m.x != 0u ? findLSB(m.x) : m.y != 0u ? kTileMaskBits + findLSB(m.y) : -1; }
EntryMask entry_bit(int i) {
    uint bit = 1u << (i & (kTileMaskBits - 1));
    return i < kTileMaskBits ? uvec2(bit, 0u) : uvec2(0u, bit);
}
EntryMask lowest_bits(int count) { return uvec2(lowest_word_bits(count), lowest_word_bits(count - kTileMaskBits)); }
uint first_word(EntryMask m) { return m.x; }
EntryMask of_first_word(uint word) { return uvec2(word, 0u); }
#else
#define EntryMask uint
const EntryMask kNoEntries = 0u;
bool any_entry(EntryMask m) { return m != 0u; }
int first_entry(EntryMask m) { return findLSB(m); }  // Returns -1 if there is none.
EntryMask entry_bit(int i) { return 1u << i; }
EntryMask lowest_bits(int count) { return lowest_word_bits(count); }
uint first_word(EntryMask m) { return m; }
EntryMask of_first_word(uint word) { return word; }
#endif

EntryMask leaf_bits(TileCounts c) { return lowest_bits(c.leaves); }
EntryMask other_bits(TileCounts c) { return ~lowest_bits(kTileEntries - c.others); }

// A ray that must search more than its tile's leaves.
struct RestEntry {
    uint slot;         // slot of the ray, with kSearchAgain
    EntryMask others;  // entries that must still be searched
};
