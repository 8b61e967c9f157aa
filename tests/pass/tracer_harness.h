// Tracers in tests: rays in, hits out; and Embree over the same tables, to compare with.
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
#include "tests/pass/tracer_inputs.h"

namespace halflight::test {

using shared::Hit;
using shared::kMiss;

/// About a batch of rays, whoever answers.
struct Question {
    std::span<const Ray> rays;
    const std::vector<std::uint32_t>* list = nullptr;  // those that are to be traced; results of others are 0
    gpu::Buffer* frame_constants = nullptr;            // where coverage counts
    rays::RayKind kind = rays::RayKind::primary;
    std::uint32_t rays_of_path = 1;  // consecutive ones; not with a list
};
/// Adds the passes that fill the results.
using AddTrace = std::function<graph::BufferHandle(graph::Graph&, const rays::RayBatch&, graph::BufferHandle results)>;
/// Result: Hit, or std::uint32_t for any hit. The batch is filled up to a multiple of 256 with dead rays.
template <class Result>
std::vector<Result> ask(graph::Executor& executor, const Question& question, const AddTrace& add);

/// Results that differ in any bit.
template <class Result>
std::size_t different(const std::vector<Result>& a, const std::vector<Result>& b) {
    std::size_t count = a.size() == b.size() ? 0 : 1;
    for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i)
        count += std::memcmp(&a[i], &b[i], sizeof(a[i])) != 0;
    return count;
}

/// Needs a current context.
class Tracer {
  public:
    explicit Tracer(const TraceTables& tables) : scene(tables) {}
    Tracer(const TraceTables& tables, const rays::PackedScene& packed) : scene(tables, packed, {}) {}
    Tracer(const TraceTables& tables, rays::NodeFormat format) : Tracer(tables, rays::pack_scene(tables, format)) {}

    /// Without `list`: all rays; with it: results of unlisted rays are 0.
    std::vector<Hit> closest(std::span<const Ray> rays, const std::vector<std::uint32_t>* list = nullptr);
    std::vector<std::uint32_t> any(std::span<const Ray> rays, const std::vector<std::uint32_t>* list = nullptr);

    rays::TraceScene scene;

  private:
    gpu::ProgramCache programs_;
};

/// With stacks that suit many scenes, which then share their programs.
rays::PackedScene roomy(rays::PackedScene packed);

/// One scene, traced plainly and by tiles, whose lists stay from question to question.
class PlainAgainstTiles {
  public:
    PlainAgainstTiles(gpu::ProgramCache& programs, const TraceTables& tables, const rays::PackedScene& packed,
                      const gpu::Defines& shading = {}, const rays::TileSettings& settings = {});
    PlainAgainstTiles(gpu::ProgramCache& programs, const TraceTables& tables,
                      rays::NodeFormat format = rays::NodeFormat::grid, const rays::TileSettings& settings = {});

    /// Rays whose answers differ in any bit, of either question.
    std::size_t different_answers(std::span<const Ray> rays, const std::vector<std::uint32_t>* list = nullptr,
                                  gpu::Buffer* frame_constants = nullptr);
    rays::RayKind kind = rays::RayKind::primary;
    std::uint32_t rays_of_path = 1;  // of questions without a list
    rays::Tracer& tiles() { return tiles_; }
    graph::History& history() { return executor_.history(); }

  private:
    rays::TraceScene scene_;
    rays::Tracer tiles_;
    graph::Executor executor_;
};

/// Robust mode, one ray at a time, all instances flattened in double.
class EmbreeOracle {
  public:
    explicit EmbreeOracle(const TraceTables& tables);

    std::vector<Hit> closest(std::span<const Ray> rays) const;
    std::vector<std::uint32_t> any(std::span<const Ray> rays) const;
    /// World positions of a triangle's corners.
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

/// How hits differ from the oracle's. A ray is excused where the triangle in question is missed or hit by less than the
/// float error of positions (condition x 2^-18 of the greatest distance in play), measured to its nearest edge, or
/// where t lies that close to t_min or t_max.
struct Comparison {
    std::size_t rays = 0;
    std::size_t hits = 0;  // the oracle's
    std::size_t excused = 0;
    std::size_t missed = 0;  // the oracle's hit is not there
    std::size_t false_hits = 0;
};
Comparison compare_hits(const EmbreeOracle& oracle, std::span<const Ray> rays, const std::vector<Hit>& hits,
                        double condition = 1);

/// For comparisons of floats bit by bit.
std::vector<std::uint32_t> bits_of(const std::vector<Hit>& hits);

/// From a little above what rays have hit, to all sides: a tenth of them almost along the surface.
std::vector<Ray> rays_onward(const EmbreeOracle& oracle, std::span<const Ray> rays, const std::vector<Hit>& hits,
                             float diagonal);

}  // namespace halflight::test
