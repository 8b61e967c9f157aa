// Tests that all tracing methods give the hits of the plain tracer bit for bit, for rays and scenes of all kinds. They
// are culling by tiles, native tracing, and raster culling. test_tracer_scenes.cpp does so for the scenes of files.
#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "engine/core/error.h"
#include "engine/device/scene_buffers.h"
#include "engine/rays/native_trace.h"
#include "tests/pass/rays/tracer_harness.h"
#include "tests/pass/scenes.h"
#include "tests/support/gpu_test.h"

namespace halflight {
namespace {

using namespace test;
using rays::NodeFormat;

constexpr NodeFormat kFormats[] = {NodeFormat::grid, NodeFormat::floating};

class TraceMethods : public GpuTest {
  protected:
    gpu::ProgramCache programs;
};

/// Returns the scene with all triangles twice, the second copy in reverse order. The triangle with the lower id wins
/// ties in any leaf.
Scene doubled(Scene scene) {
    std::vector<uvec3>& triangles = scene.meshes[0].triangles;
    triangles.insert(triangles.end(), triangles.rbegin(), triangles.rend());
    scene.meshes[0].triangle_material.resize(triangles.size());
    return scene;
}

TEST_F(TraceMethods, InstancesSoupsSliversAndTies) {
    std::size_t slivers = 0;
    for (const Scene& scene :
         {instanced_spheres(), soup(3000, 0.1f, vec3(1), 1), soup(500, 1, vec3(1, 1e-4f, 1), 2), height_field(60, 0),
          soup(5000, 0.5f, vec3(1, 1e-3f, 1e-3f), 4), soup(2000, 0.5f, vec3(1, 1e-6f, 1e-6f), 6),
          soup(3, 1, vec3(1), 4), doubled(height_field(40, 0)), doubled(soup(2000, 0.2f, vec3(1), 5))}) {
        const TraceTables tables = build_trace_tables(scene);
        slivers += tables.slivers ? 1 : 0;
        const std::vector<Ray> rays = mixed_rays(tables.bounds, 4000);
        for (const NodeFormat format : kFormats)
            EXPECT_EQ(AgainstPlain(programs, tables, format).differences({rays}, 2), "");
    }
    EXPECT_GT(slivers, 0u);
}

// Scales positions by powers of two, which must not change a hit. Raster culling runs without a scale alone, because
// its kernels flush denormal numbers.
TEST_F(TraceMethods, DegenerateTilesOfAllSizes) {
    for (const float s : {0x1p-20f, 1.0f, 0x1p20f}) {
        const auto scaled = [&](std::vector<Ray> rays) {
            for (Ray& r : rays) r = {s * r.origin, r.t_min, s * r.direction, r.t_max};
            return rays;
        };
        for (Scene scene : {soup(4000, 0.08f, vec3(1), 3), instanced_spheres()}) {
            for (Mesh& mesh : scene.meshes)
                for (vec3& p : mesh.positions) p *= s;
            for (Instance& instance : scene.instances) instance.object_to_world[3] *= dvec4(dvec3(s), 1);
            for (const NodeFormat format : kFormats) {
                SCOPED_TRACE(testing::Message() << "scale " << s << ", format " << static_cast<int>(format));
                AgainstPlain pair(programs, build_trace_tables(scene), format, {.raster = s == 1});
                std::vector<Ray> together, aligned;
                for (const std::vector<Ray>& tile : degenerate_tiles()) {
                    if (s == 1) {
                        EXPECT_EQ(pair.differences({tile}), "");
                    }
                    together.insert(together.end(), tile.begin(), tile.end());
                    aligned.insert(aligned.end(), tile.begin(), tile.end());
                    aligned.resize((aligned.size() + 63) / 64 * 64, {vec3(0), 1, vec3(1), 0});
                }
                EXPECT_EQ(pair.differences({scaled(together)}), "");
                EXPECT_EQ(pair.differences({scaled(aligned)}), "");
                if (const rays::NativeServer* native = pair.native()) {
                    EXPECT_GT(native->counts().delegated, 0u) << "directions of 1e-30 are out of range";
                    EXPECT_LT(native->counts().delegated, native->counts().rays / 4);
                }
                EXPECT_EQ(pair.differences({scaled(mixed_rays({vec3(-1), vec3(1)}, 2000))}), "");
            }
        }
    }
}

TEST_F(TraceMethods, RaysFromFarAway) {
    for (const float distance : {1e2f, 1e4f, 1e6f}) {
        std::vector<Ray> rays = camera_rays(vec3(0, 0, 2), vec3(0));
        for (const Ray& r : rays_through({vec3(-1), vec3(1)}, 2000, 8)) rays.push_back(r);
        for (Ray& r : rays) r = {r.origin - distance * r.direction, 0, r.direction, kInfinity};
        for (const Scene& scene : {soup(4000, 0.08f, vec3(1), 3), instanced_spheres()}) {
            const TraceTables tables = build_trace_tables(scene);
            for (const NodeFormat format : kFormats) {
                AgainstPlain pair(programs, tables, format, {.raster = false});
                EXPECT_EQ(pair.differences({rays}), "") << distance;
                if (pair.native()) {
                    EXPECT_EQ(pair.native()->counts().delegated, 0u);
                }
            }
        }
    }
}

TEST_F(TraceMethods, BatchesAndListsOfAnySize) {
    for (const Scene& scene : {soup(4000, 0.08f, vec3(1), 3), instanced_spheres(), Scene{}}) {
        AgainstPlain pair(programs, build_trace_tables(scene), NodeFormat::grid, {.raster = !scene.instances.empty()});
        for (const std::size_t count : {1u, 63u, 64u, 65u, 257u, 1000u}) {
            std::vector<Ray> rays = rays_through({vec3(-1), vec3(1)}, count, 2);
            EXPECT_EQ(pair.differences({rays}), "") << count;
            for (Ray& r : rays) r.t_max = -1;
            EXPECT_EQ(pair.differences({rays}), "") << count << " dead ones";
        }
        std::vector<Ray> rays = rays_through({vec3(-1), vec3(1)}, 9000, 6);
        kill_some(rays);
        std::vector<std::uint32_t> list = uneven_list(static_cast<std::uint32_t>(rays.size()));
        for (const std::size_t listed : {list.size(), std::size_t{1}, std::size_t{0}}) {
            list.resize(listed);
            EXPECT_EQ(pair.differences({rays, &list}), "") << listed;
        }
    }
}

// Coverage is looked up alike for nodes of both formats, so each format has one of the scenes.
TEST_F(TraceMethods, CoverageIsKeyedByPath) {
    gpu::Buffer constants = constants_of_paths();
    std::vector<std::uint32_t> list(3000);
    for (std::uint32_t i = 0; i < list.size(); ++i) list[i] = 2 * i;
    for (const auto& [format, scene] :
         {std::pair(NodeFormat::grid, curtain_scene()), std::pair(NodeFormat::floating, veils(60))}) {
        const TraceTables tables = build_trace_tables(scene);
        ASSERT_TRUE(tables.alpha_tested);
        const SceneBuffers buffers(tables, build_shading_tables(scene, tables));
        buffers.bind();
        const std::vector<Ray> rays = mixed_rays(tables.bounds, 4000);
        AgainstPlain pair(programs, tables, format, {}, buffers.defines());
        EXPECT_EQ(pair.differences({rays, nullptr, &constants}), "");
        EXPECT_EQ(pair.differences({rays, &list, &constants}), "");
        EXPECT_EQ(pair.differences({.rays = rays, .frame_constants = &constants, .rays_of_path = 4}), "");
        if (pair.native()) {
            EXPECT_GT(pair.native()->counts().delegated, 0u) << "rays that meet coverage";
            EXPECT_LT(pair.native()->counts().delegated, pair.native()->counts().rays);
        }
    }
}

class Native : public TraceMethods {
  protected:
    void SetUp() override {
        const std::string reason = rays::NativeServer::reason_against(rays::TraceScene(tables));
        if (!reason.empty()) GTEST_SKIP() << reason;
    }
    const TraceTables tables = build_trace_tables(soup(4000, 0.08f, vec3(1), 3));
};

// Such rays are left to the plain kernel. In a coherent batch they share the shaft of their bundle with good rays.
TEST_F(Native, RaysWithNumbersThatAreNotFinite) {
    std::vector<Ray> rays;
    for (int i = 0; i < 1024; ++i) {
        const vec2 place = 0.02f * vec2(i % 32, i / 32) - 0.3f;
        rays.push_back({vec3(place, 3), 0, vec3(0, 0, -1), kInfinity});
    }
    for (const NodeFormat format : kFormats) {
        for (const float number : {std::numeric_limits<float>::quiet_NaN(), kInfinity, -kInfinity}) {
            for (const int component : {0, 1, 2, 3, 4, 5}) {
                std::vector<Ray> bad = rays;
                std::uint64_t count = 0;
                for (std::size_t i = 5; i < bad.size(); i += 37, ++count)
                    (component < 3 ? bad[i].origin : bad[i].direction)[component % 3] = number;
                AgainstPlain pair(programs, tables, format, {.tiles = false, .raster = false});
                EXPECT_EQ(pair.differences({bad}), "") << number << " in component " << component;
                EXPECT_EQ(pair.native()->counts().delegated, 4 * count) << number << " in component " << component;
            }
        }
    }
}

// The leaves that ended rays before are missing, out of range, or any nodes and leaves of the scene. Tiles are whole
// and partial; rays are dead, short or coherent.
TEST_F(Native, AnyHitsOfTilesIgnoreTheStateOfBlockers) {
    const TraceTables instanced = build_trace_tables(instanced_spheres(), 0);
    for (const TraceTables* const of : {&tables, &instanced}) {
        std::vector<Ray> rays = camera_rays(of->bounds, vec3(0.3f, 0.4f, 1));
        std::vector<Ray> others = mixed_rays(of->bounds, 1037);
        kill_some(others);
        for (std::size_t i = 0; i < others.size(); i += 5) others[i].t_max = others[i].t_min + 0.1f * float(i % 4);
        rays.insert(rays.end(), others.begin(), others.end());
        for (const NodeFormat format : kFormats) {
            const rays::PackedScene packed = roomy(rays::pack_scene(*of, format));
            ASSERT_EQ(packed.two_level, of == &instanced);
            const rays::TraceScene scene(*of, packed, {});
            const rays::NativeTree tree = rays::build_native_tree(
                *of, format, packed.two_level, scene.nodes().read<uvec4>(), scene.heads().read<std::uint32_t>());
            const std::vector<vec4> pairs = scene.pairs().read<vec4>();
            graph::Executor executor(programs);
            const std::vector<std::uint32_t> plain = any_hits(executor, {rays}, scene);
            std::mt19937 random(1);
            for (const std::uint32_t most : {0u, 40u, 1u << 14, ~0u}) {
                SCOPED_TRACE(fmt::format("state below {}, {} instances", most, of->instances.size()));
                std::vector<std::uint32_t> blockers(rays::blockers_of(rays.size()), ~0u), left;
                for (std::uint32_t& place : blockers)
                    if (most > 0) place = static_cast<std::uint32_t>(random()) % most;
                for (int run = 0; run < 2; ++run) {
                    std::vector<std::uint32_t> found(rays.size(), 77);
                    const rays::NativeJob job{.tree = &tree,
                                              .pairs = pairs.data(),
                                              .slivers = of->slivers,
                                              .any_hit = true,
                                              .together = true,
                                              .rays = rays.data(),
                                              .blockers = blockers.data(),
                                              .results = found.data()};
                    rays::trace_native(job, 0, 1024, left);
                    rays::trace_native(job, 1024, rays.size(), left);
                    EXPECT_EQ(different(found, plain), 0u);
                    EXPECT_TRUE(left.empty());
                }
                if (most == 0 && of == &tables) {
                    EXPECT_LT(std::ranges::count(blockers, ~0u), std::ptrdiff_t(blockers.size()));
                }
            }
        }
    }
}

// The nodes are those of a smaller scene.
TEST_F(Native, IsOffAfterADifference) {
    const TraceTables other = build_trace_tables(soup(1000, 0.08f, vec3(1), 7));
    const rays::PackedScene packed = roomy(rays::pack_scene(tables)), wrong = roomy(rays::pack_scene(other));
    const rays::TraceScene scene(tables, packed, {}), wrong_scene(other, wrong, {});
    rays::NativeServer native(other, wrong_scene);
    rays::Tracer tracer(scene, native);
    graph::Executor executor(programs);
    const std::vector<Ray> rays = camera_rays(vec3(0, 0, 3), vec3(0));
    const std::vector<Hit> plain = closest_hits(executor, {rays}, scene);
    for (int run = 0; run < 2; ++run) EXPECT_EQ(different(closest_hits(executor, {rays}, tracer), plain), 0u);
    EXPECT_TRUE(native.counts().disabled);
    EXPECT_NE(native.counts().note, "");
    EXPECT_EQ(tracer.statistics().front().reason, native.counts().note);
    EXPECT_EQ(tracer.note(), native.counts().note);
}

// Batches without rays, with dead ones and with rays that meet nothing do not end the comparison.
TEST_F(Native, IsComparedByRaysThatHit) {
    const TraceTables other = build_trace_tables(soup(1000, 0.08f, vec3(1), 7));
    const rays::PackedScene packed = roomy(rays::pack_scene(tables)), wrong = roomy(rays::pack_scene(other));
    const rays::TraceScene scene(tables, packed, {}), wrong_scene(other, wrong, {});
    rays::NativeServer native(other, wrong_scene);
    rays::Tracer tracer(scene, native);
    graph::Executor executor(programs);
    const std::vector<Ray> rays = camera_rays(vec3(0, 0, 3), vec3(0)), sky = camera_rays(vec3(0, 0, 3), vec3(0, 0, 6));
    std::vector<Ray> dead = rays;
    for (Ray& ray : dead) ray.t_max = -1;
    const std::vector<std::uint32_t> none;
    for (const TraceRequest& request : {TraceRequest{rays, &none}, TraceRequest{dead}, TraceRequest{sky}})
        EXPECT_EQ(different(answers(executor, request, tracer), answers(executor, request, scene)), 0u);
    EXPECT_FALSE(native.counts().disabled);
    EXPECT_EQ(different(any_hits(executor, {rays}, tracer), any_hits(executor, {rays}, scene)), 0u);
    EXPECT_TRUE(native.counts().disabled);
}

using TileCulling = TraceMethods;

TEST_F(TileCulling, StacksNoDeeperThanNeeded) {
    for (const NodeFormat format : kFormats) {
        const TraceTables tables =
            build_trace_tables(format == NodeFormat::grid ? soup(6000, 0.3f, vec3(1), 1) : instanced_spheres());
        AgainstPlain pair(programs, tables, rays::pack_scene(tables, format), kTilesAlone);
        EXPECT_EQ(pair.differences({mixed_rays(tables.bounds, 8000)}), "");
    }
}

// Tests list capacities that fit none or some of the root's children, powers of two and others. Sizes around 32 and 64
// are the bits of a word and of a mask. Side and capacity are independent in the code, so each capacity has one side,
// because each pair compiles kernels of its own. Each runs twice, because lists are kept.
TEST_F(TileCulling, TilesAndListsOfAllSizes) {
    using Sizes = std::vector<rays::TileSettings>;
    const Sizes of_soup{{8, 1}, {8, 4}, {8, 33}, {8, 64}, {16, 3}, {16, 31}, {16, 64}, {16, 5}};
    const Sizes of_spheres{{8, 5}, {16, 40}};
    for (const auto& [scene, sizes] :
         {std::pair(soup(4000, 0.08f, vec3(1), 3), of_soup), std::pair(instanced_spheres(), of_spheres)}) {
        const TraceTables tables = build_trace_tables(scene);
        std::vector<Ray> rays = mixed_rays(tables.bounds, 2000);
        for (const std::vector<Ray>& tile : degenerate_tiles()) rays.insert(rays.end(), tile.begin(), tile.end());
        kill_some(rays);
        const std::vector<std::uint32_t> list = uneven_list(static_cast<std::uint32_t>(rays.size()));
        for (const rays::TileSettings& settings : sizes) {
            SCOPED_TRACE(testing::Message() << settings.side << " pixels, " << settings.capacity << " entries");
            Methods methods = kTilesAlone;
            methods.tile_settings = settings;
            AgainstPlain pair(programs, tables, NodeFormat::grid, methods);
            EXPECT_EQ(pair.differences({rays}, 2), "");
            if (settings.side == 16 && settings.capacity == 5) {
                EXPECT_EQ(pair.differences({rays, &list}), "");
            }
        }
    }
}

TEST_F(TileCulling, SettingsOutOfRangeAreErrors) {
    const rays::TraceScene scene(build_trace_tables(soup(3, 1, vec3(1), 4)));
    for (const rays::TileSettings wrong : {rays::TileSettings{8, 0}, {8, 65}, {4, 32}, {0, 32}, {12, 32}, {32, 32}}) {
        EXPECT_THROW(rays::Tracer(scene, rays::Culling::compute, wrong), Error) << wrong.side;
    }
}

// Each group of consecutive rays ends in one point and has one ray per member of a reuse group.
TEST_F(TileCulling, ConnectionRays) {
    const std::vector<Ray> from = rays_through({vec3(-1), vec3(1)}, 5000, 9);
    for (const Scene& scene : {soup(4000, 0.08f, vec3(1), 3), instanced_spheres()}) {
        AgainstPlain pair(programs, build_trace_tables(scene), NodeFormat::grid, kTilesAlone);
        for (const auto& [spread, group_size] : {std::pair{0.01f, 16u}, {0.1f, 4u}, {0.1f, 16u}, {1.0f, 8u}}) {
            std::vector<Ray> rays;
            for (std::size_t i = 0; i < from.size(); ++i) {
                const std::size_t group = i / group_size * group_size;
                const vec3 origin = glm::mix(from[group].origin, from[i].origin, spread);
                rays.push_back({origin, 0, from[group + 1].origin - origin, i % 5 ? 1.0f : -1.0f});
            }
            std::vector<std::uint32_t> list;
            for (std::uint32_t i = 0; i < rays.size(); i += 1 + i % 2) list.push_back(i);
            TraceRequest request{.rays = rays, .kind = rays::RayKind::connection, .rays_of_path = group_size};
            EXPECT_EQ(pair.differences(request), "") << spread;
            EXPECT_EQ(pair.differences({rays, &list, nullptr, rays::RayKind::connection}), "") << spread;
            request.rays = std::span(rays).first(1003);
            EXPECT_EQ(pair.differences(request), "") << spread;
        }
    }
}

}  // namespace
}  // namespace halflight
