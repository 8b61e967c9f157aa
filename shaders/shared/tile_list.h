// Tile lists, one copy for C++ and GLSL: the nodes and leaves that the rays of a tile can meet. Each tile has a record
// of texels (RGBA32UI). It is in the units of the hierarchy where traversal starts (grid format: cells; float format:
// world units).
//
//   texel 0 to 3  xyz: the shaft, as floats: lower and upper corner of the box of the rays' origins, then of the box of
//                 their ends. w: checksum, leaves | others << 16, unused, unused.
//   then          entries: leaves from the first place on, others from the last place back. Lists for closest hits are
//                 sorted front to back, those for any hits are not sorted.
//
// An entry is a box with a word, which is a reference of shaders/shared/bvh_nodes.h. Other entries than leaves are
// nodes to continue from, or instances.
//   grid format   (lower | upper << 16 per axis, word), one texel
//   float format  (lower, word), (upper, unused), two texels
//
// Entries have two more boxes with instances. Entries inside an instance add the instance's own box with its index,
// and the box in the units of its block with the block's head. Their first box surrounds the latter, in the tile list's
// units. Other entries add their box again, with kNoInstance or the instance that they are, and any third box.
#pragma once

#include "shaders/shared/portable.h"
#include "shaders/shared/ray_structs.h"

HALFLIGHT_SHARED_BEGIN

HALFLIGHT_SHARED_CONST int kTileMaskBits = 32;  // bits of a word, one per entry; longer lists have two words
HALFLIGHT_SHARED_CONST int kMostTileEntries = 64;
HALFLIGHT_SHARED_CONST int kTileHeaderTexels = 4;
HALFLIGHT_SHARED_CONST int kTileBoxTexels = 1;       // texels of a box in the grid format
HALFLIGHT_SHARED_CONST int kTileFloatBoxTexels = 2;  // texels of a box in the float format
HALFLIGHT_SHARED_CONST int kTileBoxes = 1;           // number of boxes of an entry
HALFLIGHT_SHARED_CONST int kTileInstanceBoxes = 3;   // number of boxes of an entry with instances
HALFLIGHT_SHARED_CONST uint kNoInstance = 0xffffffffu;

// Leaves that have ended shadow rays of a tile; they are tested first. Wrong ones only cost time.
struct TileBlockers {
    uint entries;  // mask of the first kTileMaskBits entries
    uint latest;   // reference of one of these leaves, to be found again in the tile's next list
};
HALFLIGHT_SHARED_SIZE(TileBlockers, 8)

// Header of the list of rays that need the other entries. On request it counts any-hit rays ended by a leaf remembered
// from earlier runs.
struct RestHeader {
    ListHeader list;
    uint remembered;
};
HALFLIGHT_SHARED_SIZE(RestHeader, 20)

// Flag in the list of such rays: the ray searches again from the root.
HALFLIGHT_SHARED_CONST uint kSearchAgain = 0x80000000u;

// Counters of a batch and its lists, for statistics.
struct BatchCounts {
    uint rays;     // number of live rays
    uint tiles;    // number of tiles with a live ray; lists of other tiles are not counted
    uint entries;  // number of list entries of these tiles
    uint leaves;   // number of leaves among the entries
    uint longest;  // entries of the longest list
};
HALFLIGHT_SHARED_SIZE(BatchCounts, 20)

HALFLIGHT_SHARED_END
