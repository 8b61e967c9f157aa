// Luminance in double precision.
#pragma once

#include "engine/core/math.h"

namespace halflight {

/// Returns the relative luminance of linear Rec.709 radiance (ITU-R BT.709-6, item 3.2).
inline double luminance_of(const dvec3& c) {
    return 0.2126 * c.x + 0.7152 * c.y + 0.0722 * c.z;
}

}  // namespace halflight
