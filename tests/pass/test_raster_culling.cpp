// The raster back end gives the plain tracer's hits, bit for bit, whatever it remembers and whatever queries say.
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <random>

#include "engine/io/gltf.h"
#include "engine/rays/raster.h"
#include "passes/scene_buffers.h"
#include "shaders/shared/frame.h"
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
    Pair(const TraceTables& t, const RasterSettings& settings, rays::NodeFormat format = rays::NodeFormat::grid,
         const gpu::Defines& shading = {})
        : tables(t), packed(rays::pack_scene(tables, format)), scene(tables, packed, shading), culling(packed, settings) {}
    Pair(const Scene& s, const RasterSettings& settings) : Pair(build_trace_tables(s), settings) {}

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
        if (frame_constants) batch.frame_constants = graph.import_buffer("frame constants", *frame_constants);
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
    gpu::Buffer* frame_constants = nullptr;
    gpu::ProgramCache programs;
};

std::vector<Ray> mixed_rays(const Bounds& bounds, std::size_t count, std::uint32_t seed = 1) {
    std::vector<Ray> rays = rays_through(bounds, count, seed);
    for (const vec3& from : {vec3(1, 0.4f, 0.3f), vec3(-0.2f, 1, -0.3f)}) {
        const std::vector<Ray> view = camera_rays(bounds, from);
        rays.insert(rays.end(), view.begin(), view.end());
    }
    return rays;
}

/// Small leaves, so that small scenes have many nodes.
RasterSettings small_leaves() {
    RasterSettings settings;
    settings.cut.leaf_triangles = 24;
    return settings;
}

/// Instances of a sphere, placed in all ways, over one field of a block of its own.
Scene instanced() {
    Scene scene = sphere(8, vec3(0), 0.3f);
    scene.instances.clear();
    for (int i = 0; i < 60; ++i) {
        const double a = 0.7 * i;
        dmat4 m(1);
        m[0] = {std::cos(a), 0.1 * std::sin(3 * a), std::sin(a), 0};
        m[1] = {0, 0.5 + 0.4 * std::sin(a), 0, 0};
        m[2] = {-std::sin(a), 0, std::cos(a), 0};
        m[3] = {0.1 * i * std::cos(a), 0.6 * std::sin(2 * a), 0.1 * i * std::sin(a), 1};
        add_instance(scene, 0, m);
    }
    const Scene field = height_field(24, 0.3f);
    add_instance(scene, add_mesh(scene, field.meshes[0].positions, field.meshes[0].triangles));
    return scene;
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
            Pair pair(tables, small_leaves());
            const std::vector<Ray> rays = mixed_rays(pair.tables.bounds, 4000);
            EXPECT_EQ(pair.different(rays), 0u);
            EXPECT_EQ(pair.different(rays), 0u);  // with what was learned
        }
    }
}

TEST_F(RasterCullingTest, BothNodeFormatsAndInstances) {
    for (const rays::NodeFormat format : {rays::NodeFormat::grid, rays::NodeFormat::floating}) {
        for (const Scene& scene : {instanced(), soup(3000, 0.1f, vec3(1), 1), soup(500, 1, vec3(1, 1e-4f, 1), 2)}) {
            Pair pair(build_trace_tables(scene), small_leaves(), format);
            const std::vector<Ray> rays = mixed_rays(pair.tables.bounds, 8000);
            EXPECT_EQ(pair.different(rays), 0u);
            EXPECT_EQ(pair.different(rays), 0u);
        }
    }
}

// Tiles of 64 rays that are alike in some way, or not at all.
TEST_F(RasterCullingTest, DegenerateTiles) {
    Pair pair(soup(4000, 0.08f, vec3(1), 3), small_leaves());
    const std::vector<Ray> all = rays_through({vec3(-1), vec3(1)}, 64, 5);
    const auto tile_of = [&](auto make) {
        std::vector<Ray> rays;
        for (std::size_t i = 0; i < 64; ++i) rays.push_back(make(all[i], i));
        return rays;
    };
    const float inf = kInfinity;
    std::vector<std::vector<Ray>> tiles{
        {all[0]},
        tile_of([&](const Ray&, std::size_t) { return all[1]; }),
        tile_of([](const Ray& r, std::size_t i) {
            return Ray{r.origin, 0, vec3(i % 2 ? 1 : -1, 0, 0), kInfinity};
        }),
        tile_of([&](const Ray& r, std::size_t i) {
            return i % 2 ? Ray{r.origin, 0, -all[0].direction, inf} : all[0];
        }),
        tile_of([](const Ray& r, std::size_t) {
            return Ray{vec3(0), 0, r.direction, kInfinity};
        }),
        tile_of([](const Ray& r, std::size_t i) {
            vec3 d(0);
            d[static_cast<int>(i % 3)] = r.direction.x;
            return Ray{r.origin, 0, d, kInfinity};
        }),
        tile_of([](const Ray& r, std::size_t i) {
            return Ray{r.origin, 0, r.direction, i % 2 ? 0.0f : 0.5f};
        }),
        tile_of([](const Ray& r, std::size_t) {
            return Ray{r.origin, 0, r.direction, 0};
        }),
        tile_of([](const Ray& r, std::size_t i) {
            return Ray{r.origin, i % 2 ? 0.6f : 0.0f, r.direction, 0.5f};
        }),
        tile_of([](const Ray& r, std::size_t) {
            return Ray{r.origin, 1, r.direction, 0};
        }),
        tile_of([](const Ray& r, std::size_t i) {
            return Ray{r.origin, 0, r.direction * std::exp2(static_cast<float>(i) - 32), kInfinity};
        }),
        tile_of([](const Ray& r, std::size_t i) {
            return Ray{r.origin * (i % 8 ? 1.0f : 1e9f), 0, r.direction, 1e30f};
        }),
        tile_of([](const Ray& r, std::size_t i) {
            return Ray{r.origin, 0, r.direction * (i % 8 ? 1.0f : 1e-30f), kInfinity};
        }),
        tile_of([](const Ray& r, std::size_t i) {
            return Ray{r.origin + vec3(0, 0, i % 4 ? 0.0f : 100.0f), 0, vec3(0, 1e-30f, 1), kInfinity};
        }),
    };
    for (std::size_t i = 0; i < tiles.size(); ++i) EXPECT_EQ(pair.different(tiles[i]), 0u) << i;
    std::vector<Ray> together;
    for (const std::vector<Ray>& tile : tiles) together.insert(together.end(), tile.begin(), tile.end());
    EXPECT_EQ(pair.different(together), 0u);
}

TEST_F(RasterCullingTest, ListsTraceWhatTheyNameAndNothingElse) {
    Pair pair(soup(4000, 0.08f, vec3(1), 3), small_leaves());
    const std::vector<Ray> rays = rays_through(pair.tables.bounds, 9000, 6);
    std::vector<std::uint32_t> list;
    for (std::uint32_t i = 0; i < rays.size(); i += 1 + i % 3) list.push_back(i);
    std::reverse(list.begin() + 100, list.begin() + 3000);
    EXPECT_EQ(pair.different(rays, &list), 0u);
    list.resize(1);
    EXPECT_EQ(pair.different(rays, &list), 0u);
    list.clear();
    EXPECT_EQ(pair.different(rays, &list), 0u);
}

TEST_F(RasterCullingTest, StaleAndSenselessMemoryChangesNoHit) {
    Pair pair(height_field(60, 0.6f), small_leaves());
    const std::vector<Ray> rays = mixed_rays(pair.tables.bounds, 2000);
    std::mt19937 random(7);
    for (int turn = 0; turn < 12; ++turn) {
        // Other rays leave other memories.
        pair.run<Hit>(true, camera_rays(pair.tables.bounds, vec3(std::cos(turn), 0.5f, std::sin(turn))), false,
                      nullptr);
        EXPECT_EQ(pair.different(rays), 0u);
        rays::CullState& state = pair.culling.state(kKind);
        const std::size_t bytes = pair.culling.bytes();
        const auto any_word = [&] { return static_cast<std::uint32_t>(random()); };
        const auto any_float = [&] { return std::bit_cast<float>(any_word()); };
        for (rays::CullMemory& m : state.nodes) m = {any_word(), any_word(), any_word() % (turn % 2 ? 2 : 1000)};
        state.run = any_word();
        state.eye = {any_float(), turn % 3 ? any_float() : kInfinity, any_float()};
        EXPECT_EQ(pair.different(rays), 0u);
        EXPECT_EQ(pair.culling.bytes(), bytes);
    }
    pair.culling.invalidate();
    EXPECT_EQ(pair.different(rays), 0u);
}

TEST_F(RasterCullingTest, OvercountedQueriesChangeNoHit) {
    RasterSettings settings = small_leaves();
    settings.believe_queries = false;
    Pair pair(instanced(), settings);
    const std::vector<Ray> rays = mixed_rays(pair.tables.bounds, 4000);
    EXPECT_EQ(pair.different(rays), 0u);
    EXPECT_EQ(pair.different(rays), 0u);
}

/// Squares over [0, 1]^2, one above the other, each of its own share of coverage.
Scene veils(int count) {
    Scene scene;
    scene.name = "veils";
    for (int i = 0; i < count; ++i) {
        Material material;
        material.alpha_mode = AlphaMode::blend;
        material.base_color.a = 0.05f * static_cast<float>(i % 7);
        Mesh mesh;
        const float z = 0.1f * static_cast<float>(i);
        mesh.positions = {{0, 0, z}, {1, 0, z}, {1, 1, z}, {0, 1, z}};
        mesh.normals.assign(4, vec3(0, 0, 1));
        mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
        mesh.triangle_material.assign(2, static_cast<std::uint32_t>(i));
        scene.materials.push_back(material);
        add_instance(scene, i);
        scene.meshes.push_back(mesh);
    }
    return scene;
}

TEST_F(RasterCullingTest, CoverageIsKeyedByPath) {
    const Scene scene = veils(60);
    const TraceTables tables = build_trace_tables(scene);
    const SceneBuffers buffers(tables, build_shading_tables(scene, tables));
    buffers.bind();
    shared::Frame frame{};
    frame.seed = 5;
    gpu::Buffer frame_constants("frame constants", sizeof(frame), &frame);
    Pair pair(tables, small_leaves(), rays::NodeFormat::grid, buffers.defines());
    pair.frame_constants = &frame_constants;
    const std::vector<Ray> rays = mixed_rays(tables.bounds, 4000);
    std::vector<std::uint32_t> list(3000);
    for (std::uint32_t i = 0; i < list.size(); ++i) list[i] = 2 * i;
    EXPECT_EQ(pair.different(rays), 0u);
    EXPECT_EQ(pair.different(rays, &list), 0u);
}

/// Two walls of many triangles, the second one in the shadow of the first.
Scene walls() {
    Scene scene = height_field(40, 0);
    for (vec3& p : scene.meshes[0].positions) p = {p.x, p.z, 0};
    Scene behind = scene;
    for (vec3& p : behind.meshes[0].positions) p = {0.3f * p.x, 0.3f * p.y, -1};
    add_instance(scene, add_mesh(scene, behind.meshes[0].positions, behind.meshes[0].triangles));
    return scene;
}

TEST_F(RasterCullingTest, WhatIsHiddenIsNotTracedAndStaysSo) {
    RasterSettings settings = small_leaves();
    settings.measure = true;
    Pair pair(walls(), settings);
    const std::vector<Ray> rays = camera_rays(pair.tables.bounds, vec3(0, 0, 1));
    for (int run = 0; run < 24; ++run) pair.run<Hit>(true, rays, false, nullptr);
    const rays::RasterStatistics& s = pair.culling.statistics(kKind);
    const std::vector<rays::CullNode>& nodes = pair.culling.tree().nodes;
    std::size_t leaves = 0, hidden = 0, hidden_known = 0;
    for (std::size_t i = 0; i < nodes.size(); ++i) {
        if (nodes[i].child_count != 0) continue;
        ++leaves;
        if (nodes[i].box.upper.z < 0) {
            ++hidden;
            hidden_known += pair.culling.state(kKind).nodes[i].visible == 1 ? 0 : 1;
        }
    }
    ASSERT_GT(hidden, leaves / 3);
    EXPECT_EQ(hidden_known, hidden);
    EXPECT_LT(s.leaves, 24 * (leaves - hidden) + leaves / 8);  // a few were opened before the front wall was known
    EXPECT_GT(s.saved_hidden + s.saved_visible, s.queries);
    EXPECT_GT(s.pairs, 0u);
}

}  // namespace
}  // namespace halflight
