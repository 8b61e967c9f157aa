// Tests that native tracing gives the hits of the plain tracer bit for bit, for all rays and scenes.
#include <gtest/gtest.h>

#include <filesystem>
#include <limits>

#include "engine/core/error.h"
#include "engine/device/scene_buffers.h"
#include "engine/io/gltf/gltf.h"
#include "engine/rays/native.h"
#include "shaders/shared/frame.h"
#include "tests/pass/rays/tracer_harness.h"
#include "tests/pass/scenes.h"
#include "tests/support/gpu_test.h"

namespace halflight {
namespace {

namespace fs = std::filesystem;
using namespace test;
using rays::NodeFormat;

/// Traces one scene by the plain method and natively.
class Pair {
  public:
    Pair(gpu::ProgramCache& programs, const TraceTables& tables, const rays::PackedScene& packed,
         const gpu::Defines& shading = {})
        : scene_(tables, packed, shading), native_(tables, scene_), tracer_(scene_, native_), executor_(programs) {
        executor_.poison(true);
    }
    Pair(gpu::ProgramCache& programs, const TraceTables& tables, NodeFormat format = NodeFormat::grid)
        : Pair(programs, tables, roomy(rays::pack_scene(tables, format))) {}

    /// Returns the number of rays whose closest or any hits differ in any bit, with and without bundles. The server's
    /// own comparison must have found none.
    std::size_t different_answers(std::span<const Ray> rays, const std::vector<std::uint32_t>* list = nullptr,
                                  gpu::Buffer* frame_constants = nullptr) {
        std::size_t sum = 0;
        for (const rays::RayKind kind : {rays::RayKind::primary, rays::RayKind::continuation}) {
            const TraceRequest request{rays, list, frame_constants, kind, list ? 1 : rays_of_path};
            sum += different(closest(request, scene_), closest(request, tracer_));
            sum += different(any(request, scene_), any(request, tracer_));
        }
        EXPECT_FALSE(native_.counts().disabled);
        return sum;
    }
    const rays::NativeServer::Counts& counts() const { return native_.counts(); }
    std::uint32_t rays_of_path = 1;

  private:
    template <class T>
    std::vector<Hit> closest(const TraceRequest& request, T& tracer) {
        return run_trace<Hit>(executor_, request, [&](graph::Graph& graph, const rays::RayBatch& batch, auto results) {
            return closest_hit(graph, tracer, batch, results);
        });
    }
    template <class T>
    std::vector<std::uint32_t> any(const TraceRequest& request, T& tracer) {
        return run_trace<std::uint32_t>(executor_, request,
                                        [&](graph::Graph& graph, const rays::RayBatch& batch, auto results) {
                                            return any_hit(graph, tracer, batch, results);
                                        });
    }

    rays::TraceScene scene_;
    rays::NativeServer native_;
    rays::Tracer tracer_;
    graph::Executor executor_;
};

class Native : public GpuTest {
  protected:
    void SetUp() override {
        const rays::TraceScene scene(build_trace_tables(soup(3, 1, vec3(1), 4)));
        const std::string reason = rays::NativeServer::reason_against(scene);
        if (!reason.empty()) GTEST_SKIP() << reason;
    }

    gpu::ProgramCache programs;
};

/// Makes every seventh ray and the first 100 rays inactive.
void kill_some(std::vector<Ray>& rays) {
    for (std::size_t i = 0; i < rays.size(); ++i) {
        if (i < 100 || i % 7 == 0) rays[i].t_max = -1;
    }
}

TEST_F(Native, OurScenes) {
    for (const fs::path& file : scenes_under(fs::path(HALFLIGHT_SOURCE_DIR) / "scenes")) {
        SCOPED_TRACE(file.string());
        const Scene scene = load_gltf(file);
        for (const std::size_t flatten : {kFlattenLimit, std::size_t{0}}) {
            const TraceTables tables = opaque_tables(scene, flatten);
            if (tables.triangles.empty()) continue;
            std::vector<Ray> rays = mixed_rays(tables.bounds, 4000);
            kill_some(rays);
            for (const NodeFormat format : {NodeFormat::grid, NodeFormat::floating})
                EXPECT_EQ(Pair(programs, tables, format).different_answers(rays), 0u);
        }
    }
}

TEST_F(Native, ScenesOfOtherProjects) {
    const fs::path folder = fs::path(HALFLIGHT_SHARED_DIR) / "assets";
    if (!fs::exists(folder)) GTEST_SKIP() << folder << " is not there";
    for (const fs::path& file : scenes_under(folder)) {
        SCOPED_TRACE(file.string());
        const TraceTables tables = opaque_tables(load_gltf(file), 0);
        if (tables.triangles.empty()) continue;
        Pair pair(programs, tables, roomy(rays::pack_scene(tables)));
        EXPECT_EQ(pair.different_answers(mixed_rays(tables.bounds, 4000)), 0u);
        EXPECT_EQ(pair.counts().delegated, 0u);
    }
}

/// Returns the scene with all triangles twice, the second copy in reverse order.
Scene doubled(Scene scene) {
    std::vector<uvec3>& triangles = scene.meshes[0].triangles;
    triangles.insert(triangles.end(), triangles.rbegin(), triangles.rend());
    scene.meshes[0].triangle_material.resize(triangles.size());
    return scene;
}

TEST_F(Native, InstancesSoupsSliversAndTies) {
    std::size_t slivers = 0;
    for (const Scene& scene :
         {instanced_spheres(), soup(3000, 0.1f, vec3(1), 1), soup(500, 1, vec3(1, 1e-4f, 1), 2), height_field(60, 0),
          soup(5000, 0.5f, vec3(1, 1e-3f, 1e-3f), 4), soup(2000, 0.5f, vec3(1, 1e-6f, 1e-6f), 6),
          soup(3, 1, vec3(1), 4), doubled(height_field(40, 0)), doubled(soup(2000, 0.2f, vec3(1), 5))}) {
        const TraceTables tables = build_trace_tables(scene);
        slivers += tables.slivers ? 1 : 0;
        for (const NodeFormat format : {NodeFormat::grid, NodeFormat::floating})
            EXPECT_EQ(Pair(programs, tables, format).different_answers(mixed_rays(tables.bounds, 8000)), 0u);
    }
    EXPECT_GT(slivers, 0u);
}

TEST_F(Native, DegenerateTilesOfAllSizes) {
    const auto scaled = [](std::vector<Ray> rays, float s) {
        for (Ray& r : rays) r = {s * r.origin, r.t_min, s * r.direction, r.t_max};
        return rays;
    };
    for (const float s : {0x1p-20f, 1.0f, 0x1p20f}) {
        Scene one = soup(4000, 0.08f, vec3(1), 3), many = instanced_spheres();
        for (Scene* scene : {&one, &many}) {
            for (Mesh& mesh : scene->meshes)
                for (vec3& p : mesh.positions) p *= s;
            for (Instance& instance : scene->instances) instance.object_to_world[3] *= dvec4(dvec3(s), 1);
            for (const NodeFormat format : {NodeFormat::grid, NodeFormat::floating}) {
                SCOPED_TRACE(testing::Message() << "scale " << s << ", format " << static_cast<int>(format));
                Pair pair(programs, build_trace_tables(*scene), format);
                std::vector<Ray> rays;
                for (const std::vector<Ray>& tile : degenerate_tiles()) {
                    const std::vector<Ray> some = scaled(tile, s);
                    rays.insert(rays.end(), some.begin(), some.end());
                    EXPECT_EQ(pair.different_answers(some), 0u);
                }
                EXPECT_EQ(pair.different_answers(rays), 0u);
                EXPECT_GT(pair.counts().delegated, 0u) << "directions of 1e-30 are out of range";
                EXPECT_LT(pair.counts().delegated, pair.counts().rays / 4);
            }
        }
    }
}

TEST_F(Native, RaysFromFarAway) {
    for (const float distance : {1e2f, 1e4f, 1e6f}) {
        std::vector<Ray> rays = camera_rays(vec3(0, 0, 2), vec3(0));
        for (const Ray& r : rays_through({vec3(-1), vec3(1)}, 2000, 8)) rays.push_back(r);
        for (Ray& r : rays) r = {r.origin - distance * r.direction, 0, r.direction, kInfinity};
        for (const Scene& scene : {soup(4000, 0.08f, vec3(1), 3), instanced_spheres()}) {
            const TraceTables tables = build_trace_tables(scene);
            for (const NodeFormat format : {NodeFormat::grid, NodeFormat::floating}) {
                Pair pair(programs, tables, format);
                EXPECT_EQ(pair.different_answers(rays), 0u) << distance;
                EXPECT_EQ(pair.counts().delegated, 0u);
            }
        }
    }
}

// Such rays are left to the plain kernel. In a coherent batch they share the shaft of their bundle with good rays.
TEST_F(Native, RaysWithNumbersThatAreNotFinite) {
    const TraceTables tables = build_trace_tables(soup(4000, 0.08f, vec3(1), 3));
    std::vector<Ray> rays;
    for (int i = 0; i < 1024; ++i) {
        const vec2 place = 0.02f * vec2(i % 32, i / 32) - 0.3f;
        rays.push_back({vec3(place, 3), 0, vec3(0, 0, -1), kInfinity});
    }
    for (const float number : {std::numeric_limits<float>::quiet_NaN(), kInfinity, -kInfinity}) {
        for (const int component : {0, 1, 2, 3, 4, 5}) {
            std::vector<Ray> bad = rays;
            std::uint64_t count = 0;
            for (std::size_t i = 5; i < bad.size(); i += 37, ++count)
                (component < 3 ? bad[i].origin : bad[i].direction)[component % 3] = number;
            for (const NodeFormat format : {NodeFormat::grid, NodeFormat::floating}) {
                Pair pair(programs, tables, format);
                EXPECT_EQ(pair.different_answers(bad), 0u) << number << " in component " << component;
                EXPECT_EQ(pair.counts().delegated, 4 * count) << number << " in component " << component;
            }
        }
    }
}

TEST_F(Native, BatchesAndListsOfAnySize) {
    for (const Scene& scene : {soup(4000, 0.08f, vec3(1), 3), instanced_spheres(), Scene{}}) {
        Pair pair(programs, build_trace_tables(scene));
        for (const std::size_t count : {1u, 63u, 64u, 65u, 257u, 1000u}) {
            std::vector<Ray> rays = rays_through({vec3(-1), vec3(1)}, count, 2);
            EXPECT_EQ(pair.different_answers(rays), 0u) << count;
            for (Ray& r : rays) r.t_max = -1;
            EXPECT_EQ(pair.different_answers(rays), 0u) << count << " dead ones";
        }
        std::vector<Ray> rays = rays_through({vec3(-1), vec3(1)}, 9000, 6);
        kill_some(rays);
        std::vector<std::uint32_t> list = uneven_list(static_cast<std::uint32_t>(rays.size()));
        EXPECT_EQ(pair.different_answers(rays, &list), 0u);
        list.resize(1);
        EXPECT_EQ(pair.different_answers(rays, &list), 0u);
        list.clear();
        EXPECT_EQ(pair.different_answers(rays, &list), 0u);
    }
}

TEST_F(Native, CoverageIsLeftToThePlainKernel) {
    for (const Scene& scene : {curtain_scene(), veils(60)}) {
        const TraceTables tables = build_trace_tables(scene);
        ASSERT_TRUE(tables.alpha_tested);
        const SceneBuffers buffers(tables, build_shading_tables(scene, tables));
        buffers.bind();
        shared::Frame frame{};
        frame.seed = 5;
        frame.size = {16, 4096}, frame.tiles_x = 1, frame.tiles_y = 256;  // each path has its own pixel
        gpu::Buffer frame_constants("frame constants", sizeof(frame), &frame);
        const std::vector<Ray> rays = mixed_rays(tables.bounds, 4000);
        std::vector<std::uint32_t> list(3000);
        for (std::uint32_t i = 0; i < list.size(); ++i) list[i] = 2 * i;
        Pair pair(programs, tables, roomy(rays::pack_scene(tables)), buffers.defines());
        EXPECT_EQ(pair.different_answers(rays, nullptr, &frame_constants), 0u);
        EXPECT_EQ(pair.different_answers(rays, &list, &frame_constants), 0u);
        pair.rays_of_path = 4;
        EXPECT_EQ(pair.different_answers(rays, nullptr, &frame_constants), 0u);
        EXPECT_GT(pair.counts().delegated, 0u);
        EXPECT_LT(pair.counts().delegated, pair.counts().rays);
    }
}

// The nodes are those of a smaller scene.
TEST_F(Native, IsOffAfterADifference) {
    const TraceTables tables = build_trace_tables(soup(4000, 0.08f, vec3(1), 3));
    const TraceTables other = build_trace_tables(soup(1000, 0.08f, vec3(1), 7));
    const rays::PackedScene packed = roomy(rays::pack_scene(tables)), wrong = roomy(rays::pack_scene(other));
    const rays::TraceScene scene(tables, packed, {}), wrong_scene(other, wrong, {});
    rays::NativeServer native(other, wrong_scene);
    rays::Tracer tracer(scene, native);
    graph::Executor executor(programs);
    const std::vector<Ray> rays = camera_rays(vec3(0, 0, 3), vec3(0));
    const auto trace = [&](auto& by) {
        return run_trace<Hit>(executor, {rays}, [&](graph::Graph& graph, const rays::RayBatch& batch, auto results) {
            return closest_hit(graph, by, batch, results);
        });
    };
    const std::vector<Hit> plain = trace(scene);
    for (int run = 0; run < 2; ++run) EXPECT_EQ(different(trace(tracer), plain), 0u);
    EXPECT_TRUE(native.counts().disabled);
    EXPECT_NE(native.counts().note.find("hits differ from the plain kernel's"), std::string::npos);
    EXPECT_EQ(tracer.statistics().front().reason, native.counts().note);
    EXPECT_EQ(tracer.note(), native.counts().note);
}

}  // namespace
}  // namespace halflight
