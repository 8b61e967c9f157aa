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

/// Takes the ground out of a scene for as long as it lives.
class WithoutGround {
  public:
    explicit WithoutGround(Scene& scene);
    WithoutGround(const WithoutGround&) = delete;
    WithoutGround& operator=(const WithoutGround&) = delete;
    ~WithoutGround();

  private:
    Scene& scene_;
    Scene ground_;  // instance, mesh and material of the ground; nothing without one
};

}  // namespace halflight
