// Merging of triangles to pairs with a common edge. Both triangles of a pair are tested together
// (shaders/lib/intersect.glsl), which halves the memory traffic. No OpenGL is used.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/core/math.h"

namespace halflight::rays {

using Corners = std::array<vec3, 3>;

/// Corners of a pair: 0 and 2 are the ends of the common edge, 1 is the third corner of the first triangle, 3 of the
/// second.
using Ring = std::array<vec3, 4>;

/// Two triangles with a common edge, or the same triangle twice.
struct TrianglePair {
    std::array<std::uint32_t, 2> triangles;  // indices in ascending order
    std::array<std::uint8_t, 2> apex;        // per triangle, the corner (0 to 2) that is not on the common edge
    bool reversed = false;                   // both triangles traverse the common edge in the same direction
};

/// Returns which corners (0 to 2) of the first (`which` 0) or second (1) triangle are at the ring's corners 0 and 2,
/// and opposite the common edge.
std::array<std::uint8_t, 3> corners_in_pair(const TrianglePair& pair, int which);

Ring ring_of(const TrianglePair& pair, std::span<const Corners> triangles);

/// Merges triangles so that each is in one pair. Two triangles are paired only if the area of their common box is at
/// most the sum of the areas of their boxes. By the surface area heuristic, a hierarchy then gains if a pair costs as
/// much as a triangle. Halves of parallelograms and similar pairs go first. Edges are equal if the coordinates of
/// their ends are equal. The time is linear. The result is a function of the input and of its order, which matters most
/// if the edge table reaches its limit of 2^20 entries.
/// `words` are the triangles' words of flags (engine/tables/tables.h). Pairs then have triangles of equal
/// kTriangleOneSided and kTriangleMirrored.
std::vector<TrianglePair> pair_triangles(std::span<const Corners> triangles, std::span<const std::uint32_t> words = {});

}  // namespace halflight::rays
