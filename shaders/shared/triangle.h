// Flags of triangles that kernels read: bits of the word w of TraceTables::triangles, above the material.
#pragma once

#include "shaders/shared/portable.h"

HALFLIGHT_SHARED_BEGIN

HALFLIGHT_SHARED_CONST uint kTriangleCatcher = 0x40000000u;  // part of a shadow catcher
// Seen from its front only (SHADING.md, Surfaces). Its front is the side from which its corners are counterclockwise
// in block space, or clockwise with kTriangleMirrored.
HALFLIGHT_SHARED_CONST uint kTriangleOneSided = 0x20000000u;
HALFLIGHT_SHARED_CONST uint kTriangleMirrored = 0x10000000u;

HALFLIGHT_SHARED_END
