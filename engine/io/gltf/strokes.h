// Triangles in place of points and lines: a sphere for each point, a tube for each segment of a line.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/core/math.h"

namespace halflight {

/// Triangles whose vertices lie at the radius around vertices of the primitive.
struct Strokes {
    std::vector<std::uint32_t> sources;  // vertex of the primitive that each vertex surrounds
    std::vector<vec3> directions;        // unit vector from there: the normal, and the offset over the radius
    std::vector<uvec3> triangles;
};

struct StrokeSize {
    std::size_t strokes = 0;  // spheres or tubes
    std::size_t vertices = 0;
    std::size_t triangles = 0;
};

/// Returns whether a mode of glTF draws points or lines.
bool is_stroke(int mode);

/// Returns the size of what `corners` indices draw in a mode.
StrokeSize measure_strokes(int mode, std::size_t corners);

/// Makes the strokes of indices below positions.size(). Each tube has round ends of its own and is closed, so that the
/// segments of a line meet without gaps. Positions need not be finite.
Strokes make_strokes(int mode, std::span<const std::uint32_t> indices, std::span<const vec3> positions);

}  // namespace halflight
