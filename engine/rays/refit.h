// Hierarchies whose triangles have moved: the shape stays, the boxes follow. No OpenGL.
#pragma once

#include <span>

#include "engine/rays/bvh.h"

namespace halflight::rays {

/// Gives every node the box of what is below it, from the leaves up. rings: those that the hierarchy is over, as many
/// as it was built from, wherever they are now. A leaf gets the boxes of whole pairs, so none should have been split.
void refit(Bvh& bvh, std::span<const Ring> rings);

/// What a ray that meets the root's box is expected to cost by the surface area heuristic (Goldsmith, Salmon 1987;
/// MacDonald, Booth 1990): boxes of nodes at 1, pairs of triangles at 1, each by its share of the root's area. 0 where
/// that has none.
double expected_cost(const Bvh& bvh);

}  // namespace halflight::rays
