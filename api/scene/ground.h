// A ground below a scene, on which it throws shadows.
#pragma once

#include <optional>

#include "engine/scene/scene.h"

namespace halflight {

/// Adds a shadow catcher with the name "ground": a level square around `bounds`, the bounds of the scene, with a mesh
/// and a material of its own. height: in metres; none: just below the bounds. Its edges are so far away that shadows of
/// suns above 3 degrees end on it. Does nothing if the bounds are empty.
void add_ground(Scene& scene, const WorldBounds& bounds, const std::optional<double>& height);

/// Removes the ground, the last instance of a scene, if there is one.
void remove_ground(Scene& scene);

}  // namespace halflight
