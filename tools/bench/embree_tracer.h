// Embree on the tables of a scene, one ray at a time on all threads: what the plain tracer is measured against.
#pragma once

#include <embree3/rtcore.h>

#include <memory>
#include <span>
#include <type_traits>
#include <vector>

#include "engine/scene/tables.h"
#include "shaders/shared/rays.h"

namespace halflight::bench {

class EmbreeTracer {
  public:
    /// As fast as Embree goes with single rays: its default build, its fast (not watertight) mode unless `robust`.
    /// Blocks used through transforms are Embree instances.
    EmbreeTracer(const TraceTables& tables, bool robust);

    /// coherent: hint to Embree. Hits as of the plain tracer, but for ties; instances are not told apart.
    void closest(std::span<const shared::Ray> rays, std::vector<shared::Hit>& hits, bool coherent) const;
    void any(std::span<const shared::Ray> rays, std::vector<std::uint32_t>& occluded, bool coherent) const;
    /// Geometric normal, of any length, in world space.
    vec3 normal_at(const shared::Ray& ray) const;

    double build_seconds() const { return build_seconds_; }

  private:
    struct Release {
        void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
        void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
    };
    using ScenePtr = std::unique_ptr<std::remove_pointer_t<RTCScene>, Release>;

    ScenePtr new_scene(bool robust) const;
    void attach_block(RTCScene scene, const TraceTables& tables, const Block& block) const;
    void attach_instance(const BlockInstance& instance, RTCScene block) const;

    std::unique_ptr<std::remove_pointer_t<RTCDevice>, Release> device_;
    std::vector<ScenePtr> blocks_;
    ScenePtr scene_;
    std::vector<std::uint32_t> first_triangle_;  // by geometry of the scene's own triangles; instances: by block
    double build_seconds_ = 0;
};

}  // namespace halflight::bench
