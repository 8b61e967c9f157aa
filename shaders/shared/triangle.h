// Flags of triangles that kernels read: bits of the word w of TraceTables::triangles, above the material.
#pragma once

#include "shaders/shared/portable.h"

HALFLIGHT_SHARED_BEGIN

HALFLIGHT_SHARED_CONST uint kTriangleCatcher = 0x40000000u;  // part of a shadow catcher
// Seen from its front only (SHADING.md, Surfaces). Its front is the side from which its corners are counterclockwise
// in block space, or clockwise with kTriangleMirrored.
HALFLIGHT_SHARED_CONST uint kTriangleOneSided = 0x20000000u;
HALFLIGHT_SHARED_CONST uint kTriangleMirrored = 0x10000000u;
// Pane (SHADING.md, Panes), which is never seen from its front only: the bit of kTriangleMirrored alone.
HALFLIGHT_SHARED_CONST uint kTrianglePane = kTriangleMirrored;

// Returns whether a triangle with this word is part of a pane.
HALFLIGHT_SHARED_FUNCTION bool in_pane(uint word) {
    return (word & (kTriangleOneSided | kTriangleMirrored)) == kTrianglePane;
}

HALFLIGHT_SHARED_END
