// Tests that all tracing methods give the same hits, bit for bit, in a city of a million triangles with flattened and
// shared instances.
#include <gtest/gtest.h>

#include "engine/io/gltf/gltf.h"
#include "engine/rays/raster.h"
#include "tests/pass/rays/tracer_harness.h"
#include "tests/support/gpu_test.h"
#include "tests/support/process.h"

namespace halflight {
namespace {

using namespace test;

class CityTest : public GpuTest {
  protected:
    template <class Result>
    std::vector<Result> answers(rays::Tracer& tracer, graph::Executor& executor, std::span<const Ray> rays) {
        return run_trace<Result>(executor, {rays},
                                 [&](graph::Graph& graph, const rays::RayBatch& batch, graph::BufferHandle results) {
                                     if constexpr (std::is_same_v<Result, Hit>) {
                                         return closest_hit(graph, tracer, batch, results);
                                     } else {
                                         return any_hit(graph, tracer, batch, results);
                                     }
                                 });
    }

    gpu::ProgramCache programs;
};

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
        const rays::TraceScene traced(tables, packed, {});
        rays::RasterCulling raster(packed);
        rays::Tracer plain(traced);
        rays::Tracer compute(traced, rays::Culling::compute);
        rays::Tracer rasterizing(traced, raster);

        std::vector<Ray> rays = mixed_rays(tables.bounds, 4000);
        for (const Camera& camera : scene.cameras) {  // cameras in streets and above roofs
            const vec3 eye(dvec3(camera.camera_to_world[3]) - tables.origin);
            const std::vector<Ray> view = camera_rays(eye, eye - vec3(camera.camera_to_world[2]));
            rays.insert(rays.end(), view.begin(), view.end());
        }
        graph::Executor executor(programs), by_tiles(programs), by_queries(programs);
        const std::vector<Hit> hits = answers<Hit>(plain, executor, rays);
        const std::vector<std::uint32_t> occluded = answers<std::uint32_t>(plain, executor, rays);
        EXPECT_GT(std::ranges::count_if(hits, [](const Hit& h) { return h.triangle != kMiss; }), rays.size() / 4);
        for (int turn = 0; turn < 2; ++turn) {  // the second turn uses the state of the first
            EXPECT_EQ(different(hits, answers<Hit>(compute, by_tiles, rays)), 0u);
            EXPECT_EQ(different(occluded, answers<std::uint32_t>(compute, by_tiles, rays)), 0u);
            EXPECT_EQ(different(hits, answers<Hit>(rasterizing, by_queries, rays)), 0u);
            EXPECT_EQ(different(occluded, answers<std::uint32_t>(rasterizing, by_queries, rays)), 0u);
        }
    }
}

}  // namespace
}  // namespace halflight
