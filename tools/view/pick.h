// Picking: the surface under the mouse, found by rays on the CPU. Needs no picture and does not disturb the renderer.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "tools/view/camera_control.h"

namespace halflight::view {

/// Returns the bounds of two bounds together.
WorldBounds united(const WorldBounds& a, const WorldBounds& b);

struct PickResult {
    dvec3 position;        // hit point, world units
    std::size_t instance;  // index into Picker::instances()
};

class Picker {
  public:
    explicit Picker(std::shared_ptr<const Scene> scene);
    /// Returns a picker of the same meshes with other instances of them.
    Picker with_instances(std::vector<Instance> instances) const;
    const std::vector<Instance>& instances() const { return instances_; }
    /// Returns the nearest surface; alpha is ignored. `one_sided` tells of each material whether its back faces are
    /// passed; materials beyond its end have no such faces.
    std::optional<PickResult> pick(const Ray& ray, const std::vector<bool>& one_sided = {}) const;
    /// Returns the bounds of an instance, world units.
    WorldBounds bounds(std::size_t instance) const;

  private:
    std::shared_ptr<const Scene> scene_;
    std::vector<Instance> instances_;
    std::vector<Bounds> boxes_;  // boxes of the meshes, object space
};

/// Returns the distance from a camera to the surface in the middle of its view, else to the scene's centre.
double distance_ahead(const Camera& camera, const Picker& picker, const Scene& scene);
/// Returns the distance of the point that the camera orbits at first. It is distance_ahead(), but less if walls stand
/// near the camera, because an orbit moves the camera aside by about this distance.
double orbit_distance(const Camera& camera, const Picker& picker, const Scene& scene);

}  // namespace halflight::view
