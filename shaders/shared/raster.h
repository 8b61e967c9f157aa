// Bindings and sizes of the raster back end. One copy for C++ and GLSL.
//
// A box (UNIT_RASTER_BOXES, RGBA32F) is two texels: lower end, upper end; in w, for boxes of leaves, the node and which
// of its children, as words (shaders/shared/word.h). An entry of a tile's list is a node with, from bit
// kRasterSlotShift on, a bit for each of its children that rays of the tile can meet.
#ifndef HALFLIGHT_SHARED_RASTER_H
#define HALFLIGHT_SHARED_RASTER_H

#include "shaders/shared/bindings.h"
#include "shaders/shared/portable.h"

// Texture units. UNIT_FREE: the rays.
#define UNIT_RASTER_BOXES (UNIT_FREE + 1)   // RGBA32F: boxes of culling nodes
#define UNIT_RASTER_SHAFTS (UNIT_FREE + 2)  // RGBA32F, 4 texels each: shafts of tiles, then of blocks
#define UNIT_RASTER_DEPTH (UNIT_FREE + 3)   // 2D D32F: how far a tile's rays still reach
#define UNIT_RASTER_SIZES (UNIT_FREE + 4)   // 2D R32UI: entries of a tile's list
#define UNIT_RASTER_LISTS (UNIT_FREE + 5)   // R32UI: kRasterList entries per tile

HALFLIGHT_SHARED_BEGIN

HALFLIGHT_SHARED_CONST uint kRasterCandidates = 32u;  // boxes held against tiles in one draw, at most
HALFLIGHT_SHARED_CONST uint kRasterList = 32u;        // >= kRasterCandidates
HALFLIGHT_SHARED_CONST int kRasterSlotShift = 25;

HALFLIGHT_SHARED_END

#endif
