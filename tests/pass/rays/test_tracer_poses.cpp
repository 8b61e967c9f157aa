// Tests that rays through an updated scene have the hits of a scene prepared for the pose.
#include <fmt/format.h>

#include <cmath>
#include <glm/gtc/matrix_transform.hpp>

#include "engine/rays/hierarchies.h"
#include "tests/pass/rays/tracer_harness.h"
#include "tests/support/gpu_test.h"

namespace halflight::test {
namespace {

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
            const EmbreeOracle oracle(tables);
            const Comparison c = compare_hits(oracle, rays, hits, 8);
            EXPECT_GT(c.hits, rays.size() / 10);
            EXPECT_EQ(c.missed, 0u);
            EXPECT_EQ(c.false_hits, 0u);
        }
        EXPECT_GE(refitted, 3u);
        EXPECT_GE(built, 1u) << "after it was torn";
    }
}

}  // namespace
}  // namespace halflight::test
