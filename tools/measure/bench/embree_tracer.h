// Traces rays with Embree on all threads, as a baseline for the engine's tracers.
#pragma once

#include <memory>
#include <type_traits>
#include <vector>

#include "engine/core/embree.h"
#include "engine/tables/tables.h"
#include "tools/measure/bench/ray_set.h"

namespace halflight::bench {

/// Embree's functions for rays.
enum class EmbreeMode {
    single,    // rtcIntersect1
    packet8,   // rtcIntersect8
    packet16,  // rtcIntersect16
};
const char* name(EmbreeMode mode);

class EmbreeTracer {
  public:
    /// Builds Embree's scene at default quality, in its fast (not watertight) mode unless `robust`. Blocks used through
    /// transforms are Embree instances.
    EmbreeTracer(const TraceTables& tables, bool robust);

    /// Returns whether Embree answers this call. (With instances and the hint of coherence, version 3.13.5 does not
    /// return from rtcOccluded16 and similar functions.)
    bool supports(const RaySet& set, EmbreeMode mode, bool coherent) const;
    /// Writes answers for the paths in set.order; `answers` has room for all paths. Hits equal those of the plain
    /// tracer except for ties. coherent: hint to Embree.
    void trace(const RaySet& set, EmbreeMode mode, bool coherent, Answers& answers) const;

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
    std::vector<std::uint32_t> first_triangle_;  // first triangle of each geometry; instances: of each block
    double build_seconds_ = 0;
};

}  // namespace halflight::bench
