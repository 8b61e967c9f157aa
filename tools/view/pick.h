// What is under the mouse, by rays on the CPU: needs no picture, and disturbs none.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "tools/view/camera_control.h"

namespace halflight::view {

struct Picked {
    dvec3 position;        // world
    std::size_t instance;  // of Scene::instances
};

class Picker {
  public:
    explicit Picker(std::shared_ptr<const Scene> scene);
    /// The nearest surface, whatever its alpha.
    std::optional<Picked> pick(const Ray& ray) const;
    /// Of an instance, world.
    WorldBounds bounds(std::size_t instance) const;

  private:
    std::shared_ptr<const Scene> scene_;
    std::vector<Bounds> boxes_;  // of meshes, object space
};

}  // namespace halflight::view
