// Positions of points of moving surfaces in an earlier pose, for motion vectors.
#pragma once

#include <cstdint>
#include <vector>

#include "engine/scene/scene.h"

namespace halflight {

/// An earlier pose of a scene, matched with a later one. Instances match by node and by their order within the node.
/// Instances without a match, or with other triangles, count as still.
class PreviousSurfaces {
  public:
    /// Matches the instances of two poses; `now` must outlive the object.
    PreviousSurfaces(const Scene& now, Scene before);

    /// Returns whether any point of an instance (index into Scene::instances) was elsewhere.
    bool moved(std::uint32_t instance) const { return before_of_[instance] != kNone; }
    /// Returns the earlier world position of the point `now` of a triangle. Precondition: moved(instance).
    dvec3 before(std::uint32_t instance, std::uint32_t triangle, const dvec3& now) const;

  private:
    const Scene& now_;
    Scene before_;
    std::vector<int> before_of_;  // per instance, the match in before_; kNone: the instance has not moved
};

}  // namespace halflight
