// Sizes of the raster back end. One copy for C++ and GLSL.
//
// A box (`boxes`, RGBA32F) is two texels: lower end, upper end; in w, for boxes of leaves, the node and which
// of its children, as words (shaders/shared/word.h). An entry of a tile's list is a node with, from bit
// kRasterSlotShift on, a bit for each of its children that rays of the tile can meet.
#ifndef HALFLIGHT_SHARED_RASTER_H
#define HALFLIGHT_SHARED_RASTER_H

#include "shaders/shared/portable.h"

HALFLIGHT_SHARED_BEGIN

HALFLIGHT_SHARED_CONST uint kRasterCandidates = 32u;  // boxes held against tiles in one draw, at most
HALFLIGHT_SHARED_CONST uint kRasterList = 32u;        // >= kRasterCandidates
HALFLIGHT_SHARED_CONST int kRasterSlotShift = 25;

HALFLIGHT_SHARED_END

#endif
