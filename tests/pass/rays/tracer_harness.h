// Runs tracers in tests, and Embree on the same tables for comparison.
#pragma once

#include <algorithm>
#include <array>
#include <cstring>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "engine/core/embree.h"
#include "engine/graph/execute.h"
#include "engine/rays/native.h"
#include "engine/rays/raster.h"
#include "engine/rays/rays.h"
#include "engine/rays/tracer.h"
#include "engine/tables/tables.h"
#include "shaders/shared/ray_structs.h"
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
    std::uint32_t alpha_salt = 0;
    rays::PassBacks backfaces = rays::PassBacks::none;
    bool passes_panes = false;
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

/// Traces closest hits, or any hits, by a rays::Tracer or a rays::TraceScene.
template <class T>
std::vector<Hit> closest_hits(graph::Executor& executor, const TraceRequest& request, T& tracer) {
    return run_trace<Hit>(executor, request, [&](graph::Graph& graph, const rays::RayBatch& batch, auto results) {
        return rays::closest_hit(graph, tracer, batch, results);
    });
}
template <class T>
std::vector<std::uint32_t> any_hits(graph::Executor& executor, const TraceRequest& request, T& tracer) {
    return run_trace<std::uint32_t>(executor, request,
                                    [&](graph::Graph& graph, const rays::RayBatch& batch, auto results) {
                                        return rays::any_hit(graph, tracer, batch, results);
                                    });
}

/// Closest and any hits of a batch.
struct Answers {
    std::vector<Hit> hits;
    std::vector<std::uint32_t> occluded;
};
template <class T>
Answers answers(graph::Executor& executor, const TraceRequest& request, T& tracer) {
    return {closest_hits(executor, request, tracer), any_hits(executor, request, tracer)};
}
inline std::size_t different(const Answers& a, const Answers& b) {
    return different(a.hits, b.hits) + different(a.occluded, b.occluded);
}

/// Returns frame constants (struct Frame) with a pixel of its own for each of 65536 paths.
gpu::Buffer constants_of_paths(std::uint32_t sample = 0);

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

/// Methods that are compared with the plain tracer. Native tracing is left out if the driver allows none.
struct Methods {
    bool tiles = true, native = true, raster = true;
    std::size_t raster_leaf = 24;  // triangles per leaf of raster culling; few, so that small scenes have many nodes
    rays::TileSettings tile_settings{};
};
inline constexpr Methods kTilesAlone{.native = false, .raster = false};

/// Traces one scene by the plain tracer and by other methods, whose state persists from call to call.
class AgainstPlain {
  public:
    AgainstPlain(gpu::ProgramCache& programs, const TraceTables& tables, rays::PackedScene packed,
                 const Methods& methods = {}, const gpu::Defines& shading = {});
    AgainstPlain(gpu::ProgramCache& programs, const TraceTables& tables,
                 rays::NodeFormat format = rays::NodeFormat::grid, const Methods& methods = {},
                 const gpu::Defines& shading = {})
        : AgainstPlain(programs, tables, roomy(rays::pack_scene(tables, format)), methods, shading) {}

    /// Returns the methods whose closest or any hits differ in any bit, with numbers of rays; empty if none does. Each
    /// method runs `runs` times, so later runs have the state of earlier ones.
    std::string differences(const TraceRequest& request, int runs = 1);
    /// Returns the tracer by tiles, which is there unless it was left out, and the history that holds its lists.
    rays::Tracer& tiles() { return *tracers_.front().second; }
    graph::History& history() { return executor_.history(); }
    /// Returns null if there is no native tracing.
    const rays::NativeServer* native() const { return native_.get(); }

  private:
    rays::PackedScene packed_;
    rays::TraceScene scene_;
    std::unique_ptr<rays::NativeServer> native_;
    std::optional<rays::RasterCulling> raster_;
    std::vector<std::pair<std::string, std::unique_ptr<rays::Tracer>>> tracers_;
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

/// Expects the tracer to have the oracle's hits, any hits to agree with closest ones, and 1/100 of the rays to hit.
Comparison expect_embree_hits(const EmbreeOracle& oracle, Tracer& tracer, std::span<const Ray> rays,
                              double condition = 1);

/// Returns the bits of hits, for exact comparisons.
std::vector<std::uint32_t> bits_of(const std::vector<Hit>& hits);

/// Returns rays from slightly above the hits in all directions; a tenth of them is nearly parallel to the surface.
std::vector<Ray> rays_onward(const EmbreeOracle& oracle, std::span<const Ray> rays, const std::vector<Hit>& hits,
                             float diagonal);

}  // namespace halflight::test
