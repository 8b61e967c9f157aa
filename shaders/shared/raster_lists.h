// Sizes of the raster back end, one copy for C++ and GLSL.
//
// A box (`boxes`, RGBA32F) is two texels: lower end, upper end. For boxes of leaves, w holds the node and the set of
// its children, as words (shaders/shared/word.h). An entry of a tile's list is a node and a set of its children. From
// bit kRasterSlotShift on, it has a bit for each child that rays of the tile can meet.
#pragma once

#include "shaders/shared/portable.h"

HALFLIGHT_SHARED_BEGIN

HALFLIGHT_SHARED_CONST uint kRasterCandidates = 32u;  // maximum number of boxes tested against tiles in a draw
HALFLIGHT_SHARED_CONST uint kRasterList = 32u;        // entries of a tile's list, >= kRasterCandidates
HALFLIGHT_SHARED_CONST int kRasterSlotShift = 25;

HALFLIGHT_SHARED_END
