// The plain tracer against Embree, and against what can be said without it.
#include <gtest/gtest.h>

#include <random>

#include "tests/pass/tracer_harness.h"
#include "tests/support/gpu_test.h"

namespace halflight {
namespace {

using test::compare_hits;
using test::Comparison;
using test::EmbreeOracle;
using test::Hit;
using test::kMiss;
using test::Ray;
using test::Tracer;

int add_mesh(Scene& scene, std::vector<vec3> positions, std::vector<uvec3> triangles) {
    if (scene.materials.empty()) scene.materials.emplace_back();
    Mesh mesh;
    mesh.normals.assign(positions.size(), vec3(0, 1, 0));
    mesh.triangle_material.assign(triangles.size(), 0);
    mesh.positions = std::move(positions);
    mesh.triangles = std::move(triangles);
    scene.meshes.push_back(std::move(mesh));
    return static_cast<int>(scene.meshes.size()) - 1;
}

void add_instance(Scene& scene, int mesh, const dmat4& object_to_world = dmat4(1)) {
    Instance instance;
    instance.mesh = mesh;
    instance.object_to_world = object_to_world;
    scene.instances.push_back(instance);
}

Scene of_one_mesh(const std::vector<vec3>& positions, const std::vector<uvec3>& triangles) {
    Scene scene;
    scene.name = "test";
    add_instance(scene, add_mesh(scene, positions, triangles));
    return scene;
}

/// Closed, n x 2n quads, poles included: every edge has two triangles.
Scene sphere(unsigned n, const vec3& centre, float radius) {
    std::vector<vec3> positions{centre + vec3(0, radius, 0), centre - vec3(0, radius, 0)};
    std::vector<uvec3> triangles;
    const unsigned columns = 2 * n;
    const auto at = [&](unsigned row, unsigned column) {
        if (row == 0) return 0u;
        return row == n ? 1u : 2 + (row - 1) * columns + column % columns;
    };
    for (unsigned row = 1; row < n; ++row) {
        for (unsigned column = 0; column < columns; ++column) {
            const double theta = kPi * row / n, phi = 2 * kPi * column / columns;
            positions.push_back(centre + radius * vec3(std::sin(theta) * std::cos(phi), std::cos(theta),
                                                       std::sin(theta) * std::sin(phi)));
        }
    }
    for (unsigned row = 0; row < n; ++row) {
        for (unsigned column = 0; column < columns; ++column) {
            const unsigned a = at(row, column), b = at(row + 1, column), c = at(row + 1, column + 1),
                           d = at(row, column + 1);
            if (row + 1 < n) triangles.emplace_back(a, b, c);
            if (row > 0) triangles.emplace_back(a, c, d);
        }
    }
    return of_one_mesh(positions, triangles);
}

Scene soup(std::size_t count, float size, const vec3& stretch, std::uint32_t seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> uniform(-1, 1);
    const auto point = [&] { return vec3(uniform(random), uniform(random), uniform(random)); };
    std::vector<vec3> positions;
    std::vector<uvec3> triangles;
    for (unsigned i = 0; i < count; ++i) {
        const vec3 centre = point();
        for (int k = 0; k < 3; ++k) positions.push_back(centre + size * stretch * point());
        triangles.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
    }
    return of_one_mesh(positions, triangles);
}

std::vector<Ray> all_rays(const Bounds& bounds, std::size_t count, std::uint32_t seed) {
    std::vector<Ray> rays = test::rays_through(bounds, count, seed);
    for (const vec3& from : {vec3(1, 0.3f, 0.2f), vec3(0, 0, 1), vec3(-1, 1, -1)}) {
        const std::vector<Ray> view = test::camera_rays(bounds, from);
        rays.insert(rays.end(), view.begin(), view.end());
    }
    return rays;
}

class TracerTest : public GpuTest {
  protected:
    /// Compares both node formats with Embree, closest and any hit, and tells how many rays had to be excused.
    static std::size_t check(const Scene& scene, std::size_t count, double condition = 1) {
        const TraceTables tables = build_trace_tables(scene);
        const EmbreeOracle oracle(tables);
        const std::vector<Ray> rays = all_rays(tables.bounds, count, 1);
        std::size_t excused = 0;
        for (const rays::NodeFormat format : {rays::NodeFormat::grid, rays::NodeFormat::floating}) {
            Tracer tracer(tables, format);
            const std::vector<Hit> hits = tracer.closest(rays);
            const Comparison c = compare_hits(oracle, rays, hits, condition);
            EXPECT_GT(c.hits, c.rays / 50);
            EXPECT_EQ(c.missed, 0u);
            EXPECT_EQ(c.false_hits, 0u);
            excused = std::max(excused, c.excused);
            const std::vector<std::uint32_t> occluded = tracer.any(rays);
            std::size_t different = 0;
            for (std::size_t i = 0; i < rays.size(); ++i)
                different += (hits[i].triangle != kMiss) != (occluded[i] == 1);
            EXPECT_EQ(different, 0u);
        }
        return excused;
    }
};

TEST_F(TracerTest, AgreesWithEmbreeOnASphere) {
    EXPECT_LE(check(sphere(64, vec3(0), 1), 20000), 4u);
}

TEST_F(TracerTest, AgreesWithEmbreeOnTriangleSoup) {
    EXPECT_LE(check(soup(5000, 0.1f, vec3(1), 3), 20000), 4u);
}

TEST_F(TracerTest, AgreesWithEmbreeOnSlivers) {
    EXPECT_LE(check(soup(5000, 0.5f, vec3(1, 1e-3f, 1e-3f), 4), 20000), 40u);
}

}  // namespace
}  // namespace halflight
