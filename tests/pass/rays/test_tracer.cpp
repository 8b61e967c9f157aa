// Tests the plain tracer against Embree, and against analytic results.
#include <gtest/gtest.h>

#include <glm/gtc/matrix_transform.hpp>
#include <random>

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

// The bounds are the results for these rays, with a margin for Embree on other processors.
TEST_F(TracerTest, AgreesWithEmbreeOnASphere) {
    EXPECT_LE(check(sphere(64, vec3(0), 1), 20000), 4u);
}

TEST_F(TracerTest, AgreesWithEmbreeOnTriangleSoup) {
    EXPECT_LE(check(soup(5000, 0.1f, vec3(1), 3), 20000), 4u);
}

TEST_F(TracerTest, AgreesWithEmbreeOnLargeTriangles) {
    EXPECT_LE(check(soup(500, 1, vec3(1), 5), 20000), 4u);
}

TEST_F(TracerTest, AgreesWithEmbreeOnSlivers) {
    EXPECT_LE(check(soup(5000, 0.5f, vec3(1, 1e-3f, 1e-3f), 4), 20000), 40u);
}

TEST_F(TracerTest, AgreesWithEmbreeOnAGridSeenAlongItsPlane) {
    Scene scene = height_field(64, 0.0f);
    EXPECT_LE(check(scene, 20000), 400u);  // two of the three views and half the rays lie in the plane
}

TEST_F(TracerTest, AgreesWithEmbreeOnTinyAndHugeScenes) {
    EXPECT_LE(check(sphere(32, vec3(0), 1e-6f), 5000), 4u);
    EXPECT_LE(check(sphere(32, vec3(0), 1e6f), 5000), 4u);
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

}  // namespace
}  // namespace halflight
