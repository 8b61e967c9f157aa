// What a tile of rays can meet: one record of texels (RGBA32UI) per tile, in the units of the hierarchy where traversal
// begins (grid format: cells; float format: world units). One copy for C++ and GLSL.
//
//   texel 0 to 3  xyz: the shaft, as floats: lower and upper corner of the box of the rays' origins, then of the box of
//                 their ends. w: checksum, leaves | others << 16, unused, unused.
//   then          room for entries: leaves from the first one on, others from the last one back; in lists for closest
//                 hits near ones first, in those for any hits in no order that means anything. A box with a word. Grid
//                 format: (lower | upper << 16 per axis, word), one texel. Float format: (lower, word), (upper,
//                 unused), two texels. The word is a reference of shaders/shared/bvh.h. Others: nodes to go on from, or
//                 instances.
//
// With instances, entries have two boxes more. What is inside of an instance: the instance's own box with its index,
// and the box in the units of its block with the block's head; the first box is one around the latter, in the tile
// list's units. What is not: that box again with kNoInstance, or the instance that it is; and anything.
#ifndef HALFLIGHT_SHARED_TILE_LIST_H
#define HALFLIGHT_SHARED_TILE_LIST_H

#include "shaders/shared/portable.h"
#include "shaders/shared/rays.h"

HALFLIGHT_SHARED_BEGIN

HALFLIGHT_SHARED_CONST int kTileMaskBits = 32;  // of a word, one for each entry; longer lists have two words
HALFLIGHT_SHARED_CONST int kMostTileEntries = 64;
HALFLIGHT_SHARED_CONST int kTileHeaderTexels = 4;
HALFLIGHT_SHARED_CONST int kTileBoxTexels = 1;       // grid format
HALFLIGHT_SHARED_CONST int kTileFloatBoxTexels = 2;  // float format
HALFLIGHT_SHARED_CONST int kTileBoxes = 1;           // of an entry
HALFLIGHT_SHARED_CONST int kTileInstanceBoxes = 3;   // of an entry; with instances
HALFLIGHT_SHARED_CONST uint kNoInstance = 0xffffffffu;
#ifndef __cplusplus
const int kTileRays = HALFLIGHT_TILE_RAYS;        // consecutive slots that share a list
const int kTileEntries = HALFLIGHT_TILE_ENTRIES;  // that a list has room for
#endif

// Leaves that have ended shadow rays of a tile: tested first. Wrong ones cost time.
struct TileBlockers {
    uint entries;  // mask of the first kTileMaskBits
    uint latest;   // reference of one of them, to be found again in the tile's next list
};
HALFLIGHT_SHARED_SIZE(TileBlockers, 8)

// Head of that list; and, where asked for, how many any-hit rays a leaf remembered from earlier runs has ended.
struct RestHeader {
    ListHeader list;
    uint remembered;
};
HALFLIGHT_SHARED_SIZE(RestHeader, 20)

// In the list of rays that are not done with their tile's leaves: the search begins again, at the root.
HALFLIGHT_SHARED_CONST uint kSearchAgain = 0x80000000u;

// Of a batch and its lists, for statistics.
struct BatchCounts {
    uint rays;     // alive
    uint tiles;    // with a ray alive; the others' lists do not count
    uint entries;  // of their lists
    uint leaves;   // of the entries
    uint longest;  // list: entries
};
HALFLIGHT_SHARED_SIZE(BatchCounts, 20)

HALFLIGHT_SHARED_END

#endif
