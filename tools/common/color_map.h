// Maps numbers to colours of evenly rising lightness.
#pragma once

#include "engine/core/image.h"
#include "engine/core/math.h"

namespace halflight {

/// Returns a colour of magma (van der Walt, Smith 2015, matplotlib, CC0), interpolated linearly between ten of its
/// colours: black, purple, orange, light yellow. Display-encoded sRGB; t is clamped to [0, 1].
vec3 magma(float t);

/// Returns a map of one channel in colours of magma, which end at `top` > 0; NaN is green, which magma does not have.
Image magma(const Image& map, double top);

}  // namespace halflight
