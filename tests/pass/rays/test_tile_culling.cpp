// Tests that culling by compute gives the hits of the plain tracer bit for bit, for all rays and scenes.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "engine/core/error.h"
#include "engine/device/scene_buffers.h"
#include "engine/io/gltf/gltf.h"
#include "shaders/shared/frame.h"
#include "tests/pass/rays/tracer_harness.h"
#include "tests/pass/scenes.h"
#include "tests/support/gpu_test.h"

namespace halflight {
namespace {

namespace fs = std::filesystem;
using namespace test;
using rays::NodeFormat;

class TileCulling : public GpuTest {
  protected:
    std::size_t different_answers(const Scene& scene, const std::vector<Ray>& rays,
                                  NodeFormat format = NodeFormat::grid) {
        return PlainAgainstTiles(programs, build_trace_tables(scene), format).different_answers(rays);
    }

    gpu::ProgramCache programs;
};

/// Makes every seventh ray and the first 100 rays inactive.
void kill_some(std::vector<Ray>& rays) {
    for (std::size_t i = 0; i < rays.size(); ++i) {
        if (i < 100 || i % 7 == 0) rays[i].t_max = -1;
    }
}

TEST_F(TileCulling, OurScenes) {
    for (const fs::path& file : scenes_under(fs::path(HALFLIGHT_SOURCE_DIR) / "scenes")) {
        SCOPED_TRACE(file.string());
        const Scene scene = load_gltf(file);
        for (const std::size_t flatten : {kFlattenLimit, std::size_t{0}}) {
            const TraceTables tables = opaque_tables(scene, flatten);
            if (tables.triangles.empty()) continue;
            std::vector<Ray> rays = mixed_rays(tables.bounds, 4000);
            kill_some(rays);
            for (const NodeFormat format : {NodeFormat::grid, NodeFormat::floating}) {
                EXPECT_EQ(PlainAgainstTiles(programs, tables, format).different_answers(rays), 0u);
            }
        }
    }
}

TEST_F(TileCulling, InstancesAndSoupsInBothFormats) {
    for (const NodeFormat format : {NodeFormat::grid, NodeFormat::floating}) {
        for (const Scene& scene :
             {instanced_spheres(), soup(3000, 0.1f, vec3(1), 1), soup(500, 1, vec3(1, 1e-4f, 1), 2),
              height_field(60, 0), Scene(soup(3, 1, vec3(1), 4))}) {
            const TraceTables tables = build_trace_tables(scene);
            EXPECT_EQ(PlainAgainstTiles(programs, tables, format).different_answers(mixed_rays(tables.bounds, 8000)),
                      0u);
        }
    }
}

/// Returns the scene with all triangles twice, the second copy in reverse order.
Scene doubled(Scene scene) {
    std::vector<uvec3>& triangles = scene.meshes[0].triangles;
    triangles.insert(triangles.end(), triangles.rbegin(), triangles.rend());
    scene.meshes[0].triangle_material.resize(triangles.size());
    return scene;
}

// The triangle with the lower id wins ties in any leaf.
TEST_F(TileCulling, TiesDoNotDependOnOrder) {
    for (const Scene& scene : {doubled(height_field(40, 0)), doubled(soup(2000, 0.2f, vec3(1), 5))}) {
        const TraceTables tables = build_trace_tables(scene);
        EXPECT_EQ(PlainAgainstTiles(programs, tables).different_answers(mixed_rays(tables.bounds, 1000)), 0u);
    }
}

TEST_F(TileCulling, StacksNoDeeperThanNeeded) {
    for (const NodeFormat format : {NodeFormat::grid, NodeFormat::floating}) {
        const TraceTables tables =
            build_trace_tables(format == NodeFormat::grid ? soup(6000, 0.3f, vec3(1), 1) : instanced_spheres());
        PlainAgainstTiles pair(programs, tables, rays::pack_scene(tables, format));
        EXPECT_EQ(pair.different_answers(mixed_rays(tables.bounds, 8000)), 0u);
    }
}

TEST_F(TileCulling, DegenerateTiles) {
    const std::vector<std::vector<Ray>> tiles = degenerate_tiles();
    std::vector<Ray> together;
    for (const std::vector<Ray>& tile : tiles) together.insert(together.end(), tile.begin(), tile.end());
    for (const NodeFormat format : {NodeFormat::grid, NodeFormat::floating}) {
        for (const Scene& scene : {soup(4000, 0.08f, vec3(1), 3), instanced_spheres()}) {
            PlainAgainstTiles pair(programs, build_trace_tables(scene), format);
            for (std::size_t i = 0; i < tiles.size(); ++i) EXPECT_EQ(pair.different_answers(tiles[i]), 0u) << i;
            EXPECT_EQ(pair.different_answers(together), 0u);
        }
    }
}

// Tests list capacities that fit none or some of the root's children, powers of two and others. Sizes around 32 and 64
// are the bits of a word and of a mask. Each runs twice, because lists are kept.
TEST_F(TileCulling, TilesAndListsOfAllSizes) {
    const auto expect_same = [&](const Scene& scene, const std::vector<rays::TileSettings>& all) {
        const TraceTables tables = build_trace_tables(scene);
        std::vector<Ray> rays = mixed_rays(tables.bounds, 2000);
        for (const std::vector<Ray>& tile : degenerate_tiles()) rays.insert(rays.end(), tile.begin(), tile.end());
        kill_some(rays);
        for (const rays::TileSettings& settings : all) {
            SCOPED_TRACE(testing::Message() << settings.side << " pixels, " << settings.capacity << " entries");
            PlainAgainstTiles pair(programs, tables, NodeFormat::grid, settings);
            EXPECT_EQ(pair.different_answers(rays), 0u);
            EXPECT_EQ(pair.different_answers(rays), 0u);
        }
        const std::vector<std::uint32_t> list = uneven_list(static_cast<std::uint32_t>(rays.size()));
        EXPECT_EQ(PlainAgainstTiles(programs, tables, NodeFormat::grid, all.back()).different_answers(rays, &list), 0u);
    };
    expect_same(soup(4000, 0.08f, vec3(1), 3),
                {{8, 1},  {8, 2},  {8, 3},  {8, 4},  {8, 5},  {8, 8},   {8, 16},  {8, 31},  {8, 32},  {8, 33}, {8, 48},
                 {8, 63}, {8, 64}, {16, 1}, {16, 4}, {16, 8}, {16, 31}, {16, 32}, {16, 33}, {16, 64}, {16, 5}});
    expect_same(instanced_spheres(), {{8, 5}, {8, 32}, {8, 64}, {16, 32}, {16, 40}, {16, 5}});
}

TEST_F(TileCulling, SettingsOutOfRangeAreErrors) {
    const rays::TraceScene scene(build_trace_tables(soup(3, 1, vec3(1), 4)));
    for (const rays::TileSettings wrong : {rays::TileSettings{8, 0}, {8, 65}, {4, 32}, {0, 32}, {12, 32}, {32, 32}}) {
        EXPECT_THROW(rays::Tracer(scene, rays::Culling::compute, wrong), Error) << wrong.side;
    }
}

// Scales all positions by powers of two, which must not change a hit.
TEST_F(TileCulling, ScenesAndRaysOfAllSizes) {
    const auto scaled = [](std::vector<Ray> rays, float s) {
        for (Ray& r : rays) r = {s * r.origin, r.t_min, s * r.direction, r.t_max};
        return rays;
    };
    const std::vector<Ray> mixed = mixed_rays({vec3(-1), vec3(1)}, 2000);
    for (const float s : {0x1p-20f, 0x1p20f}) {
        Scene scene = soup(4000, 0.08f, vec3(1), 3);
        for (vec3& p : scene.meshes[0].positions) p *= s;
        for (const NodeFormat format : {NodeFormat::grid, NodeFormat::floating}) {
            SCOPED_TRACE(testing::Message() << "scale " << s << ", format " << static_cast<int>(format));
            PlainAgainstTiles pair(programs, build_trace_tables(scene), format);
            EXPECT_EQ(pair.different_answers(scaled(mixed, s)), 0u);
            const std::vector<std::vector<Ray>> tiles = degenerate_tiles();
            for (std::size_t i = 0; i < tiles.size(); ++i) {
                EXPECT_EQ(pair.different_answers(scaled(tiles[i], s)), 0u) << i;
            }
        }
    }
}

TEST_F(TileCulling, RaysFromFarAway) {
    for (const float distance : {1e2f, 1e4f, 1e6f}) {
        std::vector<Ray> rays = rays_through({vec3(-1), vec3(1)}, distance < 1e6f ? 2000 : 200, 8);
        for (Ray& r : rays) r = {r.origin - distance * r.direction, 0, r.direction, kInfinity};
        for (const NodeFormat format : {NodeFormat::grid, NodeFormat::floating}) {
            EXPECT_EQ(different_answers(soup(4000, 0.08f, vec3(1), 3), rays, format), 0u) << distance;
            EXPECT_EQ(different_answers(instanced_spheres(), rays, format), 0u) << distance;
        }
    }
}

TEST_F(TileCulling, BatchesOfAnySize) {
    PlainAgainstTiles pair(programs, build_trace_tables(soup(4000, 0.08f, vec3(1), 3)));
    for (const std::size_t count : {1u, 63u, 64u, 65u, 257u, 1000u}) {
        std::vector<Ray> rays = rays_through({vec3(-1), vec3(1)}, count, 2);
        EXPECT_EQ(pair.different_answers(rays), 0u) << count;
        for (Ray& r : rays) r.t_max = -1;
        EXPECT_EQ(pair.different_answers(rays), 0u) << count << " dead ones";
    }
    EXPECT_EQ(different_answers(Scene{}, rays_through({vec3(-1), vec3(1)}, 300, 2)), 0u);
}

// Each group of consecutive rays ends in one point and has one ray per member of a reuse group.
TEST_F(TileCulling, ConnectionRays) {
    const std::vector<Ray> from = rays_through({vec3(-1), vec3(1)}, 5000, 9);
    for (const Scene& scene : {soup(4000, 0.08f, vec3(1), 3), instanced_spheres()}) {
        PlainAgainstTiles pair(programs, build_trace_tables(scene));
        pair.kind = rays::RayKind::connection;
        for (const auto& [spread, group_size] : {std::pair{0.01f, 16u}, {0.1f, 4u}, {0.1f, 16u}, {1.0f, 8u}}) {
            pair.rays_of_path = group_size;
            std::vector<Ray> rays;
            for (std::size_t i = 0; i < from.size(); ++i) {
                const std::size_t group = i / group_size * group_size;
                const vec3 origin = glm::mix(from[group].origin, from[i].origin, spread);
                rays.push_back({origin, 0, from[group + 1].origin - origin, i % 5 ? 1.0f : -1.0f});
            }
            EXPECT_EQ(pair.different_answers(rays), 0u) << spread;
            std::vector<std::uint32_t> list;
            for (std::uint32_t i = 0; i < rays.size(); i += 1 + i % 2) list.push_back(i);
            EXPECT_EQ(pair.different_answers(rays, &list), 0u) << spread;
            rays.resize(1003);
            EXPECT_EQ(pair.different_answers(rays), 0u) << spread;
        }
    }
}

TEST_F(TileCulling, ListsTraceExactlyTheListedRays) {
    for (const Scene& scene : {soup(4000, 0.08f, vec3(1), 3), instanced_spheres()}) {
        PlainAgainstTiles pair(programs, build_trace_tables(scene));
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

TEST_F(TileCulling, CoverageIsKeyedByPath) {
    for (const NodeFormat format : {NodeFormat::grid, NodeFormat::floating}) {
        const Scene scene = format == NodeFormat::grid ? curtain_scene() : veils(60);
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
        PlainAgainstTiles pair(programs, tables, roomy(rays::pack_scene(tables, format)), buffers.defines());
        EXPECT_EQ(pair.different_answers(rays, nullptr, &frame_constants), 0u);
        EXPECT_EQ(pair.different_answers(rays, &list, &frame_constants), 0u);
    }
}

}  // namespace
}  // namespace halflight
