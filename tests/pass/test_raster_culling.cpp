// The raster back end gives the plain tracer's hits, bit for bit, whatever it remembers and whatever queries say.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <random>

#include "engine/io/gltf.h"
#include "engine/rays/raster.h"
#include "tests/pass/tracer_harness.h"
#include "tests/support/gpu_test.h"

namespace halflight {
namespace {

namespace fs = std::filesystem;
using namespace test;
using rays::RasterCulling;
using rays::RasterSettings;

constexpr rays::RayKind kKind = rays::RayKind::primary;

/// One scene, both tracers.
struct Pair {
    explicit Pair(const TraceTables& t, const RasterSettings& settings = {})
        : tables(t), packed(rays::pack_scene(tables)), scene(tables, packed, {}), culling(packed, settings) {}
    explicit Pair(const Scene& s, std::size_t flatten = kFlattenLimit, const RasterSettings& settings = {})
        : Pair(build_trace_tables(s, flatten), settings) {}

    template <class Result>
    std::vector<Result> run(bool raster, std::span<const Ray> rays, bool any_hit,
                            const std::vector<std::uint32_t>* list) {
        std::vector<Ray> padded(rays.begin(), rays.end());
        padded.resize((rays.size() + 255) / 256 * 256, {vec3(0), 1, vec3(1), 0});  // dead rays
        gpu::Buffer ray_buffer = gpu::Buffer::from("rays", padded);
        gpu::Buffer results("results", padded.size() * sizeof(Result));
        std::vector<std::uint32_t> padded_list = list ? *list : std::vector<std::uint32_t>{};
        const auto count = static_cast<std::uint32_t>(padded_list.size());
        padded_list.resize(padded.size());
        gpu::Buffer list_buffer = gpu::Buffer::from("list", padded_list);
        const shared::ListHeader head{(count + 63) / 64, 1, 1, count};
        gpu::Buffer head_buffer("list header", sizeof(head), &head);

        graph::Graph graph;
        rays::RayBatch batch;
        batch.kind = kKind;
        batch.capacity = static_cast<std::uint32_t>(padded.size());
        batch.rays = graph.import_buffer("rays", ray_buffer);
        if (list) {
            batch.list = graph.import_buffer("list", list_buffer);
            batch.list_header = graph.import_buffer("list header", head_buffer);
        }
        const graph::BufferHandle target = graph.import_buffer("results", results);
        if (raster) {
            graph.output(any_hit ? raster_any_hit(graph, scene, culling, batch, target)
                                 : raster_closest_hit(graph, scene, culling, batch, target));
        } else {
            graph.output(any_hit ? rays::any_hit(graph, scene, batch, target)
                                 : rays::closest_hit(graph, scene, batch, target));
        }
        graph::Executor executor(programs);
        executor.poison(true);
        executor.run(graph::compile(graph));
        return results.read<Result>(0, rays.size());
    }

    /// Rays whose answers differ in any bit, of either question.
    std::size_t different(std::span<const Ray> rays, const std::vector<std::uint32_t>* list = nullptr) {
        const std::vector<Hit> plain = run<Hit>(false, rays, false, list), culled = run<Hit>(true, rays, false, list);
        std::size_t count = 0;
        for (std::size_t i = 0; i < rays.size(); ++i) count += std::memcmp(&plain[i], &culled[i], sizeof(Hit)) != 0;
        const auto free = run<std::uint32_t>(false, rays, true, list),
                   hidden = run<std::uint32_t>(true, rays, true, list);
        for (std::size_t i = 0; i < rays.size(); ++i) count += free[i] != hidden[i];
        return count;
    }

    TraceTables tables;
    rays::PackedScene packed;
    rays::TraceScene scene;
    RasterCulling culling;
    gpu::ProgramCache programs;
};

std::vector<Ray> mixed_rays(const Bounds& bounds, std::size_t count) {
    std::vector<Ray> rays = rays_through(bounds, count, 1);
    for (const vec3& from : {vec3(1, 0.4f, 0.3f), vec3(-0.2f, 1, -0.3f)}) {
        const std::vector<Ray> view = camera_rays(bounds, from);
        rays.insert(rays.end(), view.begin(), view.end());
    }
    return rays;
}

class RasterCullingTest : public GpuTest {};

TEST_F(RasterCullingTest, OurScenes) {
    for (const fs::directory_entry& entry : fs::directory_iterator(fs::path(HALFLIGHT_SOURCE_DIR) / "scenes")) {
        if (entry.path().extension() != ".glb") continue;
        SCOPED_TRACE(entry.path().string());
        const Scene scene = load_gltf(entry.path());
        for (const std::size_t flatten : {kFlattenLimit, std::size_t{0}}) {
            TraceTables tables = build_trace_tables(scene, flatten);
            if (tables.triangles.empty()) continue;
            for (uvec4& t : tables.triangles) t.w &= ~kTriangleAlpha;
            tables.alpha_tested = false;
            Pair pair(tables);
            const std::vector<Ray> rays = mixed_rays(pair.tables.bounds, 4000);
            EXPECT_EQ(pair.different(rays), 0u);
            EXPECT_EQ(pair.different(rays), 0u);  // with what was learned
        }
    }
}

}  // namespace
}  // namespace halflight
