// Colours of black bodies.
#pragma once

#include "engine/core/math.h"

namespace halflight {

/// Returns the colour of a black body at a temperature, linear Rec.709, largest channel 1. Colours outside the gamut
/// (below about 1900 K) are clipped. Kelvin > 0.
vec3 black_body_color(double kelvin);

/// Returns the temperature at which a black body has the colour's ratio of red to green and blue together, kelvin. The
/// range [lowest, highest] limits it. The result is exact to 0.001 K. Channels >= 0, not all 0.
double nearest_black_body(const vec3& color, double lowest, double highest);

}  // namespace halflight
