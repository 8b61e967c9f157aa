// Tests the plain tracer against Embree, and against analytic results. Rays through an updated scene have the hits of a
// scene prepared for the pose.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <random>

#include "engine/rays/hierarchies.h"
#include "tests/pass/rays/tracer_harness.h"
#include "tests/support/gpu_test.h"

namespace halflight {
namespace {

using namespace test;

std::vector<Ray> all_rays(const Bounds& bounds, std::size_t count, std::uint32_t seed) {
    std::vector<Ray> rays = rays_through(bounds, count, seed);
    for (const vec3& from : {vec3(1, 0.3f, 0.2f), vec3(0, 0, 1), vec3(-1, 1, -1)}) {
        const std::vector<Ray> view = camera_rays(bounds, from);
        rays.insert(rays.end(), view.begin(), view.end());
    }
    return rays;
}

class TracerTest : public GpuTest {
  protected:
    /// Compares both node formats with Embree, closest and any hit; returns the number of excused rays.
    static std::size_t check(const Scene& scene, std::size_t count, double condition = 1) {
        const TraceTables tables = build_trace_tables(scene);
        const EmbreeOracle oracle(tables);
        const std::vector<Ray> rays = all_rays(tables.bounds, count, 1);
        std::size_t excused = 0;
        for (const rays::NodeFormat format : {rays::NodeFormat::grid, rays::NodeFormat::floating}) {
            Tracer tracer(tables, format);
            excused = std::max(excused, expect_embree_hits(oracle, tracer, rays, condition).excused);
        }
        return excused;
    }
};

TEST_F(TracerTest, AgreesWithEmbree) {
    struct Row {
        const char* name;
        Scene scene;
        std::size_t rays;
        std::size_t most_excused;  // result for these rays, with a margin for Embree on other processors
    };
    const Row rows[] = {
        {"sphere", sphere(64, vec3(0), 1), 20000, 4},
        {"triangle soup", soup(5000, 0.1f, vec3(1), 3), 20000, 4},
        {"large triangles", soup(500, 1, vec3(1), 5), 20000, 4},
        {"slivers", soup(5000, 0.5f, vec3(1, 1e-3f, 1e-3f), 4), 20000, 40},
        {"grid in whose plane two of the three views and half the rays lie", height_field(64, 0.0f), 20000, 400},
        {"tiny sphere", sphere(32, vec3(0), 1e-6f), 5000, 4},
        {"huge sphere", sphere(32, vec3(0), 1e6f), 5000, 4},
    };
    for (const Row& row : rows) {
        SCOPED_TRACE(row.name);
        EXPECT_LE(check(row.scene, row.rays), row.most_excused);
    }
}

TEST_F(TracerTest, TrianglesBelowFloatResolutionAreNotHitFromAfar) {
    const TraceTables tables = build_trace_tables(soup(2000, 1e-7f, vec3(1), 6));
    const std::vector<Ray> rays = all_rays(tables.bounds, 20000, 2);
    const Comparison c = compare_hits(EmbreeOracle(tables), rays, Tracer(tables).closest(rays));
    EXPECT_EQ(c.missed, 0u);
    EXPECT_EQ(c.false_hits, 0u);
}

TEST_F(TracerTest, FarFromTheOriginIsLikeAtTheOrigin) {
    Scene near = sphere(32, vec3(0), 1), far = near;
    far.instances[0].object_to_world[3] = dvec4(1e6, -1e6, 1e6, 1);
    const TraceTables at_origin = build_trace_tables(near), away = build_trace_tables(far);
    const std::vector<Ray> rays = all_rays(at_origin.bounds, 5000, 1);
    EXPECT_TRUE(bits_of(Tracer(at_origin).closest(rays)) == bits_of(Tracer(away).closest(rays)));
}

TEST_F(TracerTest, AgreesWithEmbreeOnInstances) {
    Scene scene = sphere(16, vec3(5, 0, 0), 1);
    scene.instances.clear();
    const int cube =
        add_mesh(scene, soup(50, 0.3f, vec3(1), 7).meshes[0].positions, soup(50, 0.3f, vec3(1), 7).meshes[0].triangles);
    std::mt19937 random(8);
    std::uniform_real_distribution<double> uniform(-1, 1);
    for (int i = 0; i < 60; ++i) {
        dmat4 m = glm::translate(dmat4(1), 20.0 * dvec3(uniform(random), uniform(random), uniform(random)));
        m = glm::rotate(m, 3 * uniform(random), dvec3(uniform(random), 1, uniform(random)));
        m = glm::scale(m,
                       // The condition number is below 3 * 9 * 3.
                       dvec3(i % 3 == 0 ? -1.0 : 1.0, 1 + 4 * (uniform(random) + 1), 1));
        add_instance(scene, i % 2 ? cube : 0, m);
    }
    ASSERT_EQ(build_trace_tables(scene).instances.size(), 60u);
    EXPECT_LE(check(scene, 20000, 81), 60u);
}

TEST_F(TracerTest, MergedAndSharedBlocksTogether) {
    Scene scene = sphere(16, vec3(0), 1);
    add_instance(scene, 0, glm::translate(dmat4(1), dvec3(3, 0, 0)));
    add_instance(scene,
                 add_mesh(scene, height_field(8, 0.1f).meshes[0].positions, height_field(8, 0.1f).meshes[0].triangles));
    ASSERT_EQ(build_trace_tables(scene).blocks.size(), 2u);
    EXPECT_LE(check(scene, 10000, 3), 4u);
}

class TracerPoses : public GpuTest {};

/// Returns a static height field, a closed sphere that is bent by t and torn for t >= 0.9, and instances of another
/// sphere, some of which move.
Scene posed(float t) {
    Scene scene = instanced_spheres();
    const Scene ball = sphere(12, {0, 1.5f, 0}, 0.7f);
    const int mesh = add_mesh(scene, ball.meshes[0].positions, ball.meshes[0].triangles);
    add_instance(scene, mesh);
    Mesh& bent = scene.meshes[static_cast<std::size_t>(mesh)];
    bent.deforms = true;
    for (std::size_t i = 0; i < bent.positions.size(); ++i) {
        vec3& p = bent.positions[i];
        p.x += t * std::sin(3 * p.y);
        if (t > 0.9f) p = vec3(p.z * float(i % 7), p.x, p.y * float(i % 5));
    }
    for (std::size_t i = 0; i < scene.instances.size(); i += 3) {
        Instance& instance = scene.instances[i];
        instance.moves = true;
        instance.object_to_world = glm::translate(dmat4(1), dvec3(0, 0.5 * t, t)) * instance.object_to_world;
    }
    return scene;
}

TEST_F(TracerPoses, HitsEqualThoseOfANewScene) {
    for (const std::size_t flatten : {std::size_t{0}, kFlattenLimit}) {
        const TraceTables reference = build_trace_tables(posed(0), flatten);
        rays::Hierarchies hierarchies(reference);
        rays::PackedScene packed = roomy(rays::pack_scene(reference, hierarchies));
        Tracer tracer(reference, packed);
        TraceTables last = reference;
        std::size_t refitted = 0, built = 0;
        for (const float t : {0.2f, 0.95f, 0.5f, 0.0f}) {
            SCOPED_TRACE(fmt::format("flattened to {} triangles, pose {}", flatten, t));
            const TraceTables tables = build_trace_tables(posed(t), flatten, reference.origin);
            EXPECT_EQ(tables.origin, reference.origin);
            hierarchies.update(last, tables);
            refitted += hierarchies.counts().refitted;
            built += hierarchies.counts().built;
            EXPECT_GE(hierarchies.counts().kept, 1u);
            rays::PackedScene now = roomy(rays::pack_scene(tables, hierarchies));
            const std::uint32_t serial = tracer.scene.serial();
            tracer.scene.update(tables, now, {}, &packed);
            EXPECT_NE(tracer.scene.serial(), serial) << "lists of the last pose would count as valid";
            packed = std::move(now);
            last = tables;

            const std::vector<Ray> rays = mixed_rays(tables.bounds, 20000);
            const std::vector<Hit> hits = tracer.closest(rays);
            Tracer fresh(tables, roomy(rays::pack_scene(tables)));
            EXPECT_EQ(different(hits, fresh.closest(rays)), 0u);
            EXPECT_EQ(different(tracer.any(rays), fresh.any(rays)), 0u);
            expect_embree_hits(EmbreeOracle(tables), tracer, rays, 8);
        }
        EXPECT_GE(refitted, 3u);
        EXPECT_GE(built, 1u) << "after it was torn";
    }
}

}  // namespace
}  // namespace halflight
