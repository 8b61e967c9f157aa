// Surfaces that edits add behind those of a scene: rectangles and discs that shine, and a ground for shadows.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "engine/scene/scene.h"

namespace halflight {

/// A rectangle or a disc that shines to one side.
struct AreaLamp {
    PunctualLight light;  // position, direction, intensity (nits), light group and links
    bool disc = false;
    vec2 size{1};  // metres, > 0: width and height, twice the diameter of a disc
};

/// Returns the transform from a square of side 1, or a disc of diameter 1, in X and Y to the lamp. It shines to -Z, and X
/// is level.
dmat4 transform_of(const AreaLamp& lamp);
/// Adds a mesh and an instance for each lamp that is not black. The surface is that of EXT_lights_area
/// (engine/scene/area_light_shape.h).
void add_area_lamps(const std::vector<AreaLamp>& lamps, Scene& scene);
/// Returns the lamps that were added.
std::vector<AreaLamp> area_lamps_of(const Scene& scene);

/// Adds a shadow catcher with the name "ground": a level square around `bounds`, the bounds of the scene, with a mesh
/// and a material of its own. height: in metres; none: just below the bounds. Its edges are so far away that shadows of
/// suns above 3 degrees end on it. Does nothing if the bounds are empty.
void add_ground(Scene& scene, const WorldBounds& bounds, const std::optional<double>& height);

/// Numbers of objects without those that were added.
struct OwnParts {
    std::size_t instances, meshes, materials;
};
OwnParts own_parts(const Scene& scene);

/// Removes all that was added.
void remove_added(Scene& scene);

/// Takes the added surfaces out of a scene for as long as it lives.
class WithoutAdded {
  public:
    explicit WithoutAdded(Scene& scene);
    WithoutAdded(const WithoutAdded&) = delete;
    WithoutAdded& operator=(const WithoutAdded&) = delete;
    ~WithoutAdded();

  private:
    Scene& scene_;
    Scene added_;  // instances, meshes and materials
};

}  // namespace halflight
