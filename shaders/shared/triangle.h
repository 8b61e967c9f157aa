// Flags of triangles that kernels read: bits of the word w of TraceTables::triangles, above the material.
#pragma once

#include "shaders/shared/portable.h"

HALFLIGHT_SHARED_BEGIN

HALFLIGHT_SHARED_CONST uint kTriangleCatcher = 0x40000000u;  // part of a shadow catcher

HALFLIGHT_SHARED_END
