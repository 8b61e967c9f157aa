// Triangles two by two: two with a common edge are tested against rays together (shaders/lib/intersect.glsl), which
// takes half of the memory traffic. Pure: no OpenGL.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/core/math.h"

namespace halflight::rays {

using Corners = std::array<vec3, 3>;

/// Corners of a pair: 0 and 2 are those of the common edge, 1 is the first triangle's third, 3 the second's.
using Ring = std::array<vec3, 4>;

/// Two triangles with a common edge, or twice the same one.
struct TrianglePair {
    std::array<std::uint32_t, 2> triangles;  // ascending
    std::array<std::uint8_t, 2> apex;        // corner of each, 0 to 2, that is not on the common edge
    bool reversed = false;                   // both run along the common edge in the same direction
};

/// Which of its corners, 0 to 2, the first (`which` 0) or second (1) triangle of a pair has at the ring's corner 0, at
/// the ring's corner 2, and beside the common edge.
std::array<std::uint8_t, 3> corners_in_pair(const TrianglePair& pair, int which);

Ring ring_of(const TrianglePair& pair, std::span<const Corners> triangles);

/// Every triangle in one pair. Two are paired where the box around both has no greater area than their two boxes
/// together, which is where a hierarchy that tests a pair at the cost of one triangle gains by the surface area
/// heuristic; halves of parallelograms and the like go first. Edges are the same where the coordinates of their ends
/// are. A function of the input alone, in linear time; of its order, too: where there are so many triangles that the
/// table of edges ends at 2^20 entries, most of all.
std::vector<TrianglePair> pair_triangles(std::span<const Corners> triangles);

}  // namespace halflight::rays
