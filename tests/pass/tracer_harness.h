// The plain tracer in tests: rays in, hits out; and Embree over the same tables, to compare with.
#pragma once

#include <embree3/rtcore.h>

#include <array>
#include <memory>
#include <span>
#include <type_traits>
#include <vector>

#include "engine/graph/execute.h"
#include "engine/rays/rays.h"
#include "engine/scene/tables.h"
#include "shaders/shared/rays.h"

namespace halflight::test {

using shared::Hit;
using shared::kMiss;
using shared::Ray;

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
    template <class Result>
    std::vector<Result> run(std::span<const Ray> rays, const std::vector<std::uint32_t>* list, bool any_hit);
    gpu::ProgramCache programs_;
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

/// Scenes of one material; each function returns an index or a scene of one mesh and one instance.
int add_mesh(Scene& scene, const std::vector<vec3>& positions, const std::vector<uvec3>& triangles);
void add_instance(Scene& scene, int mesh, const dmat4& object_to_world = dmat4(1));
Scene of_one_mesh(const std::vector<vec3>& positions, const std::vector<uvec3>& triangles);
/// Closed, n x 2n quads, poles included: every edge has two triangles.
Scene sphere(unsigned n, const vec3& centre, float radius);
/// n x n quads over [-1, 1]^2 in x and z.
Scene height_field(unsigned n, float height);
/// Triangles with centres in [-1, 1]^3 and corners within size * stretch of them.
Scene soup(unsigned count, float size, const vec3& stretch, std::uint32_t seed);

/// For comparisons of floats bit by bit.
std::vector<std::uint32_t> bits_of(const std::vector<Hit>& hits);

/// Rays that look through the scene from all sides: from points in and around its bounds, to points in it.
std::vector<Ray> rays_through(const Bounds& bounds, std::size_t count, std::uint32_t seed);
/// From a little above what rays have hit, to all sides: a tenth of them almost along the surface.
std::vector<Ray> rays_onward(const EmbreeOracle& oracle, std::span<const Ray> rays, const std::vector<Hit>& hits,
                             float diagonal);
/// 64 x 64 pixels, from a point outside towards the centre of the bounds.
std::vector<Ray> camera_rays(const Bounds& bounds, const vec3& from_direction);

}  // namespace halflight::test
