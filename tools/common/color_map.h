// Numbers as colours, in an order that the eye sees.
#pragma once

#include "engine/core/image.h"
#include "engine/core/math.h"

namespace halflight {

/// Magma (van der Walt, Smith 2015, matplotlib, CC0), at ten of its colours and linear between them: from black over
/// purple and orange to a light yellow, lightness rising evenly. Display-encoded sRGB; t outside [0, 1] is clamped.
vec3 magma(float t);

/// A map of one channel as such a picture, `top` > 0 and above as the lightest; NaN, which magma has no colour for,
/// green.
Image magma(const Image& map, double top);

}  // namespace halflight
