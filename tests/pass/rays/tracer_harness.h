// Runs tracers in tests, and Embree on the same tables for comparison.
#pragma once

#include <embree3/rtcore.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <functional>
#include <memory>
#include <span>
#include <type_traits>
#include <vector>

#include "engine/graph/execute.h"
#include "engine/rays/rays.h"
#include "engine/rays/tracer.h"
#include "engine/tables/tables.h"
#include "shaders/shared/rays.h"
#include "tests/pass/rays/tracer_inputs.h"

namespace halflight::test {

using shared::Hit;
using shared::kMiss;

/// Options for tracing a batch of rays by any tracer.
struct TraceRequest {
    std::span<const Ray> rays;
    const std::vector<std::uint32_t>* list = nullptr;  // indices of rays to trace; results of others are 0
    gpu::Buffer* frame_constants = nullptr;            // buffer of struct Frame, needed for coverage
    rays::RayKind kind = rays::RayKind::primary;
    std::uint32_t rays_of_path = 1;  // number of consecutive rays per path; not with a list
};
/// Adds the passes that fill the results.
using AddTrace = std::function<graph::BufferHandle(graph::Graph&, const rays::RayBatch&, graph::BufferHandle results)>;
/// Traces rays. Result is Hit, or std::uint32_t for any-hit rays. The batch is padded with inactive rays to a multiple
/// of 256.
template <class Result>
std::vector<Result> run_trace(graph::Executor& executor, const TraceRequest& request, const AddTrace& add);

/// Returns the number of results that differ in any bit.
template <class Result>
std::size_t different(const std::vector<Result>& a, const std::vector<Result>& b) {
    std::size_t count = a.size() == b.size() ? 0 : 1;
    for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i)
        count += std::memcmp(&a[i], &b[i], sizeof(a[i])) != 0;
    return count;
}

/// Owns a scene's tracer; needs a current context.
class Tracer {
  public:
    explicit Tracer(const TraceTables& tables) : scene(tables) {}
    Tracer(const TraceTables& tables, const rays::PackedScene& packed) : scene(tables, packed, {}) {}
    Tracer(const TraceTables& tables, rays::NodeFormat format) : Tracer(tables, rays::pack_scene(tables, format)) {}

    /// Traces closest hits of all rays, or of the rays in `list`; results of other rays are 0.
    std::vector<Hit> closest(std::span<const Ray> rays, const std::vector<std::uint32_t>* list = nullptr);
    std::vector<std::uint32_t> any(std::span<const Ray> rays, const std::vector<std::uint32_t>* list = nullptr);

    rays::TraceScene scene;

  private:
    gpu::ProgramCache programs_;
};

/// Returns the scene with generous stack sizes, so that many scenes can share programs.
rays::PackedScene roomy(rays::PackedScene packed);

/// Traces one scene by the plain method and by tiles, whose lists persist from call to call.
class PlainAgainstTiles {
  public:
    PlainAgainstTiles(gpu::ProgramCache& programs, const TraceTables& tables, const rays::PackedScene& packed,
                      const gpu::Defines& shading = {}, const rays::TileSettings& settings = {});
    PlainAgainstTiles(gpu::ProgramCache& programs, const TraceTables& tables,
                      rays::NodeFormat format = rays::NodeFormat::grid, const rays::TileSettings& settings = {});

    /// Returns the number of rays whose closest or any hits differ in any bit.
    std::size_t different_answers(std::span<const Ray> rays, const std::vector<std::uint32_t>* list = nullptr,
                                  gpu::Buffer* frame_constants = nullptr);
    rays::RayKind kind = rays::RayKind::primary;
    std::uint32_t rays_of_path = 1;  // consecutive rays per path in calls without a list
    rays::Tracer& tiles() { return tiles_; }
    graph::History& history() { return executor_.history(); }

  private:
    rays::TraceScene scene_;
    rays::Tracer tiles_;
    graph::Executor executor_;
};

/// Traces with Embree in robust mode, one ray at a time, with all instances flattened in double.
class EmbreeOracle {
  public:
    explicit EmbreeOracle(const TraceTables& tables);

    std::vector<Hit> closest(std::span<const Ray> rays) const;
    std::vector<std::uint32_t> any(std::span<const Ray> rays) const;
    /// Returns the world positions of a triangle's corners.
    std::array<dvec3, 3> corners(std::uint32_t instance, std::uint32_t triangle) const;

  private:
    struct Release {
        void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
        void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
    };
    const TraceTables& tables_;
    std::unique_ptr<std::remove_pointer_t<RTCDevice>, Release> device_;
    std::unique_ptr<std::remove_pointer_t<RTCScene>, Release> scene_;
};

/// Differences between hits and the oracle's. A ray is excused if an edge of the triangle, t_min or t_max is
/// nearer to the hit than the float error of positions. That error is condition x 2^-18 of the largest distance
/// involved.
struct Comparison {
    std::size_t rays = 0;
    std::size_t hits = 0;  // hits of the oracle
    std::size_t excused = 0;
    std::size_t missed = 0;  // hits that only the oracle has
    std::size_t false_hits = 0;
};
Comparison compare_hits(const EmbreeOracle& oracle, std::span<const Ray> rays, const std::vector<Hit>& hits,
                        double condition = 1);

/// Returns the bits of hits, for exact comparisons.
std::vector<std::uint32_t> bits_of(const std::vector<Hit>& hits);

/// Returns rays from slightly above the hits in all directions; a tenth of them is nearly parallel to the surface.
std::vector<Ray> rays_onward(const EmbreeOracle& oracle, std::span<const Ray> rays, const std::vector<Hit>& hits,
                             float diagonal);

}  // namespace halflight::test
