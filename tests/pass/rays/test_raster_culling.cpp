// Tests that raster culling gives the hits of the plain tracer bit for bit, with any visibility state and any query
// answers. It must trace no hidden nodes. test_methods.cpp tests other rays and scenes.
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <random>

#include "shaders/shared/raster_lists.h"
#include "tests/pass/rays/tracer_harness.h"
#include "tests/support/gpu_test.h"

namespace halflight {
namespace {

using namespace test;
using rays::RasterCulling;
using rays::RasterSettings;

constexpr rays::RayKind kKind = rays::RayKind::primary;

/// Tables of one scene, and both tracers.
struct Pair {
    Pair(const Scene& s, const RasterSettings& settings)
        : tables(build_trace_tables(s)),
          packed(rays::pack_scene(tables)),
          scene(tables, packed, {}),
          culling(packed, settings) {
        executor.poison(true);
    }

    std::vector<Hit> culled(std::span<const Ray> rays) { return closest_hits(executor, {rays}, tracer); }
    /// Returns the number of rays whose closest or any hits differ in any bit.
    std::size_t different_answers(std::span<const Ray> rays) {
        return different(answers(executor, {rays}, scene), answers(executor, {rays}, tracer));
    }

    TraceTables tables;
    rays::PackedScene packed;
    rays::TraceScene scene;
    RasterCulling culling;
    rays::Tracer tracer{scene, culling};
    gpu::ProgramCache programs;
    graph::Executor executor{programs};
};

/// Returns settings with small leaves, so that small scenes have many nodes.
RasterSettings small_leaves() {
    RasterSettings settings;
    settings.cut.leaf_triangles = 24;
    return settings;
}

class RasterCullingTest : public GpuTest {};

TEST_F(RasterCullingTest, StaleAndRandomStateChangesNoHit) {
    Pair pair(height_field(60, 0.6f), small_leaves());
    const std::vector<Ray> rays = mixed_rays(pair.tables.bounds, 2000);
    std::mt19937 random(7);
    for (int turn = 0; turn < 12; ++turn) {
        // Different rays leave a different visibility state behind.
        pair.culled(camera_rays(pair.tables.bounds, vec3(std::cos(turn), 0.5f, std::sin(turn))));
        EXPECT_EQ(pair.different_answers(rays), 0u);
        rays::CullState& state = pair.culling.state({kKind});
        const std::size_t bytes = pair.culling.bytes();
        const auto any_word = [&] { return static_cast<std::uint32_t>(random()); };
        const auto any_float = [&] { return std::bit_cast<float>(any_word()); };
        for (rays::CullMemory& m : state.nodes) m = {any_word(), any_word(), any_word() % (turn % 2 ? 2 : 1000)};
        state.run = any_word();
        state.eye = {any_float(), turn % 3 ? any_float() : kInfinity, any_float()};
        EXPECT_EQ(pair.different_answers(rays), 0u);
        EXPECT_EQ(pair.culling.bytes(), bytes);
    }
    pair.culling.invalidate();
    EXPECT_EQ(pair.different_answers(rays), 0u);
}

TEST_F(RasterCullingTest, OvercountedQueriesChangeNoHit) {
    RasterSettings settings = small_leaves();
    settings.believe_queries = false;
    Pair pair(instanced_spheres(), settings);
    const std::vector<Ray> rays = mixed_rays(pair.tables.bounds, 4000);
    EXPECT_EQ(pair.different_answers(rays), 0u);
    EXPECT_EQ(pair.different_answers(rays), 0u);
}

/// Returns two walls of many triangles; the first one occludes the second.
Scene walls() {
    Scene scene = height_field(40, 0);
    for (vec3& p : scene.meshes[0].positions) p = {p.x, p.z, 0};
    Scene behind = scene;
    for (vec3& p : behind.meshes[0].positions) p = {0.3f * p.x, 0.3f * p.y, -1};
    add_instance(scene, add_mesh(scene, behind.meshes[0].positions, behind.meshes[0].triangles));
    return scene;
}

TEST_F(RasterCullingTest, HiddenNodesAreNotTraced) {
    RasterSettings settings = small_leaves();
    settings.measure = true;
    Pair pair(walls(), settings);
    const std::vector<Ray> rays = camera_rays(pair.tables.bounds, vec3(0, 0, 1));
    for (int run = 0; run < 24; ++run) pair.culled(rays);
    const rays::RasterStatistics& s = pair.culling.statistics(kKind, 0);
    const std::vector<rays::CullNode>& nodes = pair.culling.tree().nodes;
    const float between = 0.5f * (pair.tables.bounds.lower.z + pair.tables.bounds.upper.z);
    std::size_t leaves = 0, hidden = 0, hidden_known = 0;
    for (std::size_t i = 0; i < nodes.size(); ++i) {
        if (nodes[i].child_count != 0) continue;
        ++leaves;
        if (nodes[i].box.upper.z < between) {
            ++hidden;
            hidden_known += pair.culling.state({kKind}).nodes[i].visible == 1 ? 0 : 1;
        }
    }
    ASSERT_GT(hidden, leaves / 3);
    EXPECT_EQ(hidden_known, hidden);
    EXPECT_LT(s.leaves, 24 * (leaves - hidden) + leaves / 8);  // the first run traces some hidden leaves
    EXPECT_GT(s.saved_hidden + s.saved_visible, s.queries);
    EXPECT_GT(s.pairs, 0u);
}

/// Returns narrow tiles of 64 rays from above through [-1, 1]^3.
std::vector<Ray> beams(int tiles) {
    std::mt19937 random(8);
    std::uniform_real_distribution<float> uniform(-1, 1);
    const auto point = [&](float z) { return vec3(uniform(random), uniform(random), z); };
    std::vector<Ray> rays;
    for (int tile = 0; tile < tiles; ++tile) {
        const vec3 from = point(2), to = point(-1);
        for (int i = 0; i < 64; ++i) {
            const vec3 origin = from + 1e-4f * point(0);
            rays.push_back({origin, 0, to + 1e-4f * point(0) - origin, kInfinity});
        }
    }
    return rays;
}

// Narrow tiles can meet more nodes of dense geometry than a list can hold.
TEST_F(RasterCullingTest, ListsNeverOverflow) {
    Scene scene = soup(20000, 0.2f, vec3(1), 4);
    std::vector<vec3>& corners = scene.meshes[0].positions;  // the moves below make slivers, which few rays hit
    for (std::size_t i = 0; i < corners.size(); i += 3)
        corners[i + 2] = glm::mix(corners[i + 1], corners[i + 2], 0.03f);
    // Lists hold one node of the CPU's tree, or several.
    for (const std::size_t leaf_triangles : {32768, 2048}) {
        RasterSettings settings;
        settings.cut.leaf_triangles = leaf_triangles;
        settings.measure = true;
        Pair pair(scene, settings);
        const std::vector<Ray> rays = beams(16);
        const rays::RasterStatistics& s = pair.culling.statistics(kKind, 0);
        std::size_t longest = 0;
        for (std::size_t first = 0; first < rays.size(); first += 64) {
            // In the second run most leaves are known to be visible. One draw traces them, and its pairs are the list
            // of one tile.
            for (int run = 0; run < 2; ++run) {
                const rays::RasterStatistics before = s;
                pair.culled(std::span(rays).subspan(first, 64));
                if (s.traces == before.traces + 1) longest = std::max(longest, s.pairs - before.pairs);
            }
        }
        EXPECT_EQ(longest, shared::kRasterList);
        // Lists are adjacent in memory, so an overflow would damage the next one.
        EXPECT_EQ(pair.different_answers(rays), 0u);
        EXPECT_EQ(pair.different_answers(rays), 0u);
    }
}

}  // namespace
}  // namespace halflight
