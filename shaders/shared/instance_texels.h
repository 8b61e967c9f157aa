// Block instance rows (kUnitInstances, RGBA32F; instance_rows()): kInstanceStride texels per BlockInstance. A matrix
// row holds the three coefficients and, in w, the translation.
#pragma once

#include "shaders/shared/portable.h"

HALFLIGHT_SHARED_BEGIN

HALFLIGHT_SHARED_CONST int kInstanceStride = 7;
HALFLIGHT_SHARED_CONST int kInstanceBlockToWorld = 0;  // rows of block_to_world, texels 0-2
HALFLIGHT_SHARED_CONST int kInstanceWorldToBlock = 3;  // rows of world_to_block, texels 3-5
HALFLIGHT_SHARED_CONST int kInstanceMoved = 6;         // x: 0 if the matrix is exactly 1, else 1

HALFLIGHT_SHARED_END
