// Where points of moving surfaces were before.
#pragma once

#include <cstdint>
#include <vector>

#include "engine/scene/scene.h"

namespace halflight {

/// A pose of a scene, looked at from a later one. Instances are the same where node and place among the node's are;
/// those whose triangles changed, or that were not there, count as still.
class PreviousSurfaces {
  public:
    /// `now` must outlive it.
    PreviousSurfaces(const Scene& now, Scene before);

    /// Whether any point of an instance (of Scene::instances) was elsewhere.
    bool moved(std::uint32_t instance) const { return before_of_[instance] != kNone; }
    /// Where, in the world, the point `now` of a triangle of its mesh was; of an instance that has moved().
    dvec3 before(std::uint32_t instance, std::uint32_t triangle, const dvec3& now) const;

  private:
    const Scene& now_;
    Scene before_;
    std::vector<int> before_of_;  // by instance: that of before_, or kNone where it has not moved
};

}  // namespace halflight
