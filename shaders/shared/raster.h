// Bindings and sizes of the raster back end. One copy for C++ and GLSL.
//
// A box (UNIT_RASTER_BOXES, RGBA32F) is two texels: lower end, upper end; in w, for boxes of pieces, the node and which of
// its children, as words (shaders/shared/word.h).
#ifndef HALFLIGHT_SHARED_RASTER_H
#define HALFLIGHT_SHARED_RASTER_H

#include "shaders/shared/bindings.h"
#include "shaders/shared/portable.h"

// Texture units. UNIT_FREE: the rays.
#define UNIT_RASTER_BOXES 17   // RGBA32F: boxes of pieces, then of culling nodes
#define UNIT_RASTER_SHAFTS 18  // RGBA32F, 4 texels each: shafts of tiles, then of blocks
#define UNIT_RASTER_DEPTH 19   // 2D D32F: how far a tile's rays still reach
#define UNIT_RASTER_MASK 20    // 2D RGBA32UI: a tile's candidates

HALFLIGHT_SHARED_BEGIN

HALFLIGHT_SHARED_CONST uint kRasterCandidates = 128u;  // of one draw, at most: the bits of a texel
HALFLIGHT_SHARED_CONST uint kRasterLeafPieces = 16u;   // of one leaf, at most
HALFLIGHT_SHARED_CONST uint kRasterLeaves = 8u;        // of one draw: leaf i has candidates 16 i to 16 i + 15

HALFLIGHT_SHARED_END

#endif
