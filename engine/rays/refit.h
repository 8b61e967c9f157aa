// Refitting of hierarchies whose triangles have moved: the shape is kept, the boxes are updated. No OpenGL is used.
#pragma once

#include <span>

#include "engine/rays/bvh.h"

namespace halflight::rays {

/// Updates the box of every node from the leaves up. `rings` are the current rings of the hierarchy, in the order of
/// its construction. A leaf gets the boxes of whole pairs, so no pair should have been split.
void refit(Bvh& bvh, std::span<const Ring> rings);

/// Returns the expected cost of a ray that meets the root's box, by the surface area heuristic (Goldsmith, Salmon 1987;
/// MacDonald, Booth 1990). Boxes of nodes and pairs of triangles cost 1 each, weighted by their area relative to the
/// root's. Returns 0 if the root has no area.
double expected_cost(const Bvh& bvh);

}  // namespace halflight::rays
