// Tests that hits do not depend on which pages are in memory.
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <random>

#include "engine/paging/page_server.h"
#include "tests/pass/rays/tracer_harness.h"
#include "tests/support/gpu_test.h"
#include "tests/support/memory_pages.h"

namespace halflight {
namespace {

using namespace test;

constexpr paging::PageLimits kSmallPages{32, 16};

std::size_t bytes_of(const paging::PageLimits& limits, std::size_t slots) {
    return slots * (limits.pairs + limits.nodes) * 64;
}

/// A scene in memory, without triangles split between leaves, and the same scene in pages.
class InCoreAgainstPages {
  public:
    InCoreAgainstPages(const Scene& scene, std::size_t slots, const paging::PageLimits& limits = kSmallPages)
        : tables_(build_trace_tables(scene, ~std::size_t{0})),
          core_(tables_, rays::pack_scene(tables_, rays::Hierarchies(tables_, tables_.triangles.size() / 3 + 1)), {}),
          source_(tables_, 200, limits),
          pool_(source_, bytes_of(limits, slots)),
          server_(pool_),
          paged_(pool_.scene(), server_),
          executor_(programs_) {
        executor_.poison(true);
    }

    std::size_t different_answers(std::span<const Ray> rays, const std::vector<std::uint32_t>* list = nullptr) {
        TraceRequest request{.rays = rays, .list = list};
        const auto plain = [&](auto trace) {
            return [this, trace](graph::Graph& g, const rays::RayBatch& b, graph::BufferHandle r) {
                return trace(g, core_, b, r);
            };
        };
        const auto closest =
            run_trace<Hit>(executor_, request, plain([](auto&... a) { return rays::closest_hit(a...); }));
        const auto any =
            run_trace<std::uint32_t>(executor_, request, plain([](auto&... a) { return rays::any_hit(a...); }));
        hits_ =
            static_cast<std::size_t>(std::ranges::count_if(closest, [](const Hit& h) { return h.triangle != kMiss; }));
        return different(closest,
                         run_trace<Hit>(executor_, request,
                                        [this](graph::Graph& g, const rays::RayBatch& b, graph::BufferHandle r) {
                                            return rays::closest_hit(g, paged_, b, r);
                                        })) +
               different(any, run_trace<std::uint32_t>(
                                  executor_, request,
                                  [this](graph::Graph& g, const rays::RayBatch& b, graph::BufferHandle r) {
                                      return rays::any_hit(g, paged_, b, r);
                                  }));
    }
    const TraceTables& tables() const { return tables_; }
    paging::PagePool& pool() { return pool_; }
    paging::PageServer& server() { return server_; }
    std::size_t hits() const { return hits_; }

  private:
    gpu::ProgramCache programs_;
    TraceTables tables_;
    rays::TraceScene core_;
    MemoryPages source_;
    paging::PagePool pool_;
    paging::PageServer server_;
    rays::Tracer paged_;
    graph::Executor executor_;
    std::size_t hits_ = 0;
};

class PagingTest : public GpuTest {
  protected:
    /// Compares cold and warm pools of several sizes with the scene in memory.
    static void check(const Scene& scene, std::initializer_list<std::size_t> slots, std::size_t count = 3000) {
        for (const std::size_t s : slots) {
            SCOPED_TRACE(s);
            InCoreAgainstPages pair(scene, s);
            const std::vector<Ray> rays = rays_through(pair.tables().bounds, count, 1);
            EXPECT_EQ(pair.different_answers(rays), 0u) << "cold";
            EXPECT_GT(pair.hits(), count / 50);
            EXPECT_EQ(pair.different_answers(rays), 0u) << "warm";
            const std::vector<Ray> others = camera_rays(pair.tables().bounds, vec3(1, 0.3f, 0.2f));
            EXPECT_EQ(pair.different_answers(others), 0u) << "other rays";
        }
    }
};

TEST_F(PagingTest, HitsDoNotDependOnThePool) {
    check(soup(5000, 0.1f, vec3(1), 3), {1000, 30, 8});
    check(sphere(64, vec3(0), 1), {1000, 8});
    check(soup(2000, 1, vec3(1), 5), {16});
}

TEST_F(PagingTest, OneSlot) {
    check(soup(600, 0.2f, vec3(1), 3), {1}, 500);
}

TEST_F(PagingTest, Slivers) {
    check(soup(3000, 0.5f, vec3(1, 1e-3f, 1e-3f), 4), {8, 1000});
}

TEST_F(PagingTest, ListsOfRays) {
    InCoreAgainstPages pair(soup(3000, 0.1f, vec3(1), 3), 8);
    const std::vector<Ray> rays = rays_through(pair.tables().bounds, 3000, 2);
    std::vector<std::uint32_t> list;
    for (std::uint32_t i = 0; i < rays.size(); i += 3) list.push_back(i);
    EXPECT_EQ(pair.different_answers(rays, &list), 0u);
    list.clear();
    EXPECT_EQ(pair.different_answers(rays, &list), 0u);
}

TEST_F(PagingTest, AWarmPoolLoadsNothing) {
    InCoreAgainstPages pair(soup(5000, 0.1f, vec3(1), 3), 1000);
    const std::vector<Ray> rays = rays_through(pair.tables().bounds, 3000, 1);
    pair.different_answers(rays);
    const paging::PagingStatistics cold = pair.server().statistics();
    EXPECT_GT(cold.traffic.loaded, 50u);
    EXPECT_GT(cold.rounds, 2u);
    EXPECT_EQ(cold.sweeps, 0u);
    pair.server().reset_statistics();
    pair.different_answers(rays);
    const paging::PagingStatistics warm = pair.server().statistics();
    EXPECT_EQ(warm.traffic.loaded, 0u);
    EXPECT_EQ(warm.rounds, 2u);
    EXPECT_EQ(warm.again, 0u);
}

TEST_F(PagingTest, ASmallPoolSweeps) {
    InCoreAgainstPages pair(soup(5000, 0.3f, vec3(1), 3), 4);
    const std::vector<Ray> rays = rays_through(pair.tables().bounds, 2000, 1);
    EXPECT_EQ(pair.different_answers(rays), 0u);
    EXPECT_GT(pair.server().statistics().sweeps, 0u);
    EXPECT_GT(pair.server().statistics().windows, pair.server().statistics().sweeps);
}

// Stiff cases: many ties, distant scenes, extreme scales, rays that cross all pages, scenes without triangles.
TEST_F(PagingTest, CoincidentTriangles) {
    Scene scene = soup(1, 0.9f, vec3(1), 3);
    scene.meshes[0].triangles.resize(1000, scene.meshes[0].triangles[0]);
    scene.meshes[0].triangle_material.resize(1000);
    check(scene, {2, 1000}, 1000);
}

TEST_F(PagingTest, ATriangleAsLargeAsTheScene) {
    Scene scene = soup(2000, 0.05f, vec3(1), 3);
    Mesh& mesh = scene.meshes[0];
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    for (const vec3& p : {vec3(-2, -2, 0), vec3(2, -2, 0.1f), vec3(0, 3, -0.1f)}) {
        mesh.positions.push_back(p);
        mesh.normals.emplace_back(0, 0, 1);
    }
    mesh.triangles.push_back(first + uvec3(0, 1, 2));
    mesh.triangle_material.push_back(0);
    check(scene, {4, 1000});
}

TEST_F(PagingTest, ScalesAndDistances) {
    for (const float scale : {1e-12f, 1e12f, 1.0f}) {
        SCOPED_TRACE(scale);
        Scene scene = soup(1500, 0.1f, vec3(1), 3);
        for (vec3& p : scene.meshes[0].positions) p = scale * p + (scale == 1 ? vec3(1e7f, 0, -1e7f) : vec3(0));
        check(scene, {4, 1000}, 1000);
    }
}

TEST_F(PagingTest, RaysThatCrossAllPages) {
    InCoreAgainstPages pair(height_field(64, 0.0f), 4);
    std::vector<Ray> rays;
    const Bounds& b = pair.tables().bounds;
    for (int i = 0; i < 200; ++i) {
        const float s = (static_cast<float>(i) + 0.5f) / 200;
        const vec3 from = glm::mix(b.lower, b.upper, vec3(s)) - vec3(2 * b.extent().x, 0, 0);
        rays.push_back({from, 0, vec3(1, 0, 0), kInfinity});
        rays.push_back({vec3(from.x, b.lower.y + 1e-4f, from.z), 0, vec3(1, 1e-6f, 0), kInfinity});
    }
    EXPECT_EQ(pair.different_answers(rays), 0u);
}

TEST_F(PagingTest, NoTriangles) {
    InCoreAgainstPages pair(Scene{}, 4);
    const std::vector<Ray> rays{{vec3(0), 0, vec3(0, 0, 1), kInfinity}};
    EXPECT_EQ(pair.different_answers(rays), 0u);
}

}  // namespace
}  // namespace halflight
