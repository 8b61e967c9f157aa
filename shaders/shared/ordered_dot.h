// The scalar product in one order. Versions of Mesa differ in the order of dot() in precise code, and since 25 they take
// other code into account for it, so that parts of a kernel that a scene does not need could change bits.
#pragma once

#include "shaders/shared/portable.h"

HALFLIGHT_SHARED_BEGIN

// Returns dot(a, b), summed from the last term on.
HALFLIGHT_SHARED_FUNCTION float ordered_dot(vec3 a, vec3 b) {
    HALFLIGHT_SHARED_PRECISE float sum = a.z * b.z + a.y * b.y + a.x * b.x;
    return sum;
}

HALFLIGHT_SHARED_END
