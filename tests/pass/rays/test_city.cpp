// Tests that all tracing methods give the same hits, bit for bit, in a city of a million triangles with flattened and
// shared instances.
#include <gtest/gtest.h>

#include "engine/io/gltf/gltf.h"
#include "tests/pass/rays/tracer_harness.h"
#include "tests/support/gpu_test.h"
#include "tests/support/process.h"

namespace halflight {
namespace {

using namespace test;

using CityTest = GpuTest;

TEST_F(CityTest, HitsDoNotDependOnTheMethod) {
    const TemporaryFolder folder;
    const std::string file = (folder / "city.glb").string();
    const Outcome made = run_program({"city", "--triangles", "1000000", file});
    ASSERT_EQ(made.status, 0) << made.err;
    const Scene scene = load_gltf(file);
    for (const std::size_t flatten : {std::size_t{0}, std::size_t{1} << 20}) {
        const TraceTables tables = opaque_tables(scene, flatten);
        const rays::PackedScene packed = rays::pack_scene(tables);
        ASSERT_EQ(packed.two_level, flatten == 0);
        std::vector<Ray> rays = mixed_rays(tables.bounds, 4000);
        for (const Camera& camera : scene.cameras) {  // cameras in streets and above roofs
            const vec3 eye(dvec3(camera.camera_to_world[3]) - tables.origin);
            const std::vector<Ray> view = camera_rays(eye, eye - vec3(camera.camera_to_world[2]));
            rays.insert(rays.end(), view.begin(), view.end());
        }
        gpu::ProgramCache programs;
        graph::Executor executor(programs);
        const rays::TraceScene plain(tables, packed, {});
        const std::vector<Hit> hits = closest_hits(executor, {rays}, plain);
        EXPECT_GT(std::ranges::count_if(hits, [](const Hit& h) { return h.triangle != kMiss; }), rays.size() / 4);
        AgainstPlain all(programs, tables, packed, {.native = false, .raster_leaf = rays::CutSizes{}.leaf_triangles});
        EXPECT_EQ(all.differences({rays}, 2), "");
    }
}

}  // namespace
}  // namespace halflight
