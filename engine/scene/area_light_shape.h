// The surfaces of lights that are rectangles and discs.
#pragma once

#include <vector>

#include "engine/core/math.h"

namespace halflight {

/// Corners of triangles of a light in the plane of X and Y and of the thin prism behind it, three for each triangle.
struct AreaLightShape {
    std::vector<vec3> front{}, body{};  // the face to -Z, and all others
};

/// Returns the shape of a square of side 1, or of a disc of diameter 1, which has 64 sides and the area of its circle.
/// Surfaces emit on both sides, so the body keeps the light that the front emits backwards. Shadow rays end a little
/// before the front, so a rim around it lets those from behind meet the body earlier.
AreaLightShape area_light_shape(bool disc);

}  // namespace halflight
