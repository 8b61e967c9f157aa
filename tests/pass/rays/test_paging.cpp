// Tests that hits do not depend on which pages are in memory. tests/stiff has extreme scenes in pages.
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <thread>
#include <utility>

#include "engine/core/error.h"
#include "engine/paging/page_server.h"
#include "tests/pass/rays/tracer_harness.h"
#include "tests/support/error_message.h"
#include "tests/support/gpu_test.h"
#include "tests/support/memory_pages.h"

namespace halflight {
namespace {

using namespace test;

constexpr paging::PageLimits kSmallPages{1536};

/// Faults of a source.
struct Disk {
    std::chrono::microseconds delay{0};  // time that a page takes
    std::uint32_t damaged_after = ~0u;   // pages that can be read before one is damaged
};

class SlowPages final : public paging::PageSource {
  public:
    SlowPages(const paging::PageSource& pages, const Disk& disk) : pages_(pages), disk_(disk) {}
    const paging::PageIndex& index() const override { return pages_.index(); }
    paging::Page read(std::uint32_t page) const override {
        std::this_thread::sleep_for(disk_.delay);
        if (reads_++ >= disk_.damaged_after) throw Error("slow.pages", "page {} is damaged", page);
        return pages_.read(page);
    }
    void read_rows(std::span<const std::uint32_t> triangles, paging::TriangleRows& rows) const override {
        pages_.read_rows(triangles, rows);
    }

  private:
    const paging::PageSource& pages_;
    Disk disk_;
    mutable std::atomic<std::uint32_t> reads_{0};
};

/// A scene in memory, without triangles split between leaves, and the same scene in pages.
class InCoreAgainstPages {
  public:
    using Schedule = paging::PageSchedule;
    using Method = paging::PageQueries::Method;
    InCoreAgainstPages(const Scene& scene, std::size_t slots, Schedule schedule = paging::kDefaultPageSchedule,
                       const Disk& disk = {}, Method method = Method::compute,
                       const paging::PageLimits& limits = kSmallPages)
        : tables_(build_trace_tables(scene, ~std::size_t{0})),
          core_(tables_, rays::pack_scene(tables_, rays::Hierarchies(tables_, tables_.triangles.size() / 3 + 1)), {}),
          pages_(tables_, 200, limits),
          source_(pages_, disk),
          pool_(source_, slots * paging::PagePool::slot_bytes(source_.index())),
          server_(pool_, schedule, method),
          paged_(pool_.scene(), server_),
          executor_(programs_) {
        executor_.poison(true);
    }

    std::size_t different_answers(std::span<const Ray> rays, const std::vector<std::uint32_t>* list = nullptr,
                                  rays::RayKind kind = rays::RayKind::primary,
                                  rays::PassBacks backfaces = rays::PassBacks::none) {
        const TraceRequest request{.rays = rays, .list = list, .kind = kind, .backfaces = backfaces};
        const Answers plain = answers(executor_, request, core_);
        hits_ = static_cast<std::size_t>(
            std::ranges::count_if(plain.hits, [](const Hit& h) { return h.triangle != kMiss; }));
        return different(plain, answers(executor_, request, paged_));
    }
    const TraceTables& tables() const { return tables_; }
    paging::PagePool& pool() { return pool_; }
    paging::PageServer& server() { return server_; }
    std::size_t hits() const { return hits_; }

  private:
    gpu::ProgramCache programs_;
    TraceTables tables_;
    rays::TraceScene core_;
    MemoryPages pages_;
    SlowPages source_;
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

    static constexpr rays::RayKind kKinds[] = {rays::RayKind::primary, rays::RayKind::shadow, rays::RayKind::diffuse};
};

TEST_F(PagingTest, HitsDoNotDependOnThePool) {
    check(soup(5000, 0.1f, vec3(1), 3), {1000, 30, 8});
    check(sphere(64, vec3(0), 1), {1000, 8});
    check(soup(2000, 1, vec3(1), 5), {16});
    check(soup(600, 0.2f, vec3(1), 3), {1}, 500);
    check(soup(3000, 0.5f, vec3(1, 1e-3f, 1e-3f), 4), {8, 1000});  // slivers
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
    pair.server().reset_statistics();
    pair.different_answers(rays);
    const paging::PagingStatistics warm = pair.server().statistics();
    EXPECT_EQ(warm.traffic.loaded, 0u);
    EXPECT_EQ(warm.rounds, 2u);
    EXPECT_EQ(warm.again, 0u);
}

TEST_F(PagingTest, SchedulesAgree) {
    using Method = paging::PageQueries::Method;
    const Scene scene = soup(5000, 0.1f, vec3(1), 3);
    for (const auto& [schedule, method] : {std::pair(paging::PageSchedule::demand, Method::compute),
                                           std::pair(paging::PageSchedule::set, Method::compute),
                                           std::pair(paging::PageSchedule::queries, Method::compute),
                                           std::pair(paging::PageSchedule::queries, Method::raster)}) {
        for (const std::size_t slots : std::initializer_list<std::size_t>{1, 25, 50, 1000}) {
            SCOPED_TRACE(testing::Message() << name(schedule) << ", " << slots << " slots");
            InCoreAgainstPages pair(scene, slots, schedule, {}, method);
            for (int turn = 0; turn < 3; ++turn) {
                const vec3 from(1, 0.3f + 0.05f * static_cast<float>(turn), 0.2f);
                std::vector<Ray> rays = camera_rays(pair.tables().bounds, from);
                if (slots == 1) rays.resize(64);
                for (const rays::RayKind kind : kKinds)
                    EXPECT_EQ(pair.different_answers(rays, nullptr, kind), 0u) << "turn " << turn;
            }
        }
    }
}

TEST_F(PagingTest, ABatchFindsThePagesOfItsLastRun) {
    InCoreAgainstPages pair(soup(5000, 0.02f, vec3(1), 3), 150, paging::PageSchedule::set);
    const std::vector<Ray> left = camera_rays(vec3(-0.6f, 0, 1.6f), vec3(-0.6f, 0, 0));
    const std::vector<Ray> right = camera_rays(vec3(0, 1.6f, 0.6f), vec3(0, 0, 0.6f));
    for (int turn = 0; turn < 3; ++turn) {
        pair.server().reset_statistics();
        EXPECT_EQ(pair.different_answers(left, nullptr, rays::RayKind::diffuse), 0u);
        EXPECT_EQ(pair.different_answers(right, nullptr, rays::RayKind::glossy), 0u);
        const paging::PagingStatistics s = pair.server().statistics();
        if (turn == 0) continue;
        EXPECT_GT(s.traffic.evicted, 0u);
        EXPECT_GT(s.prefetched_used, s.prefetched_unused);
    }
}

TEST_F(PagingTest, PoolsThatHoldAllPagesCountNoUse) {
    InCoreAgainstPages pair(soup(5000, 0.02f, vec3(1), 3), 150, paging::PageSchedule::queries);
    InCoreAgainstPages all(soup(5000, 0.02f, vec3(1), 3), 100000, paging::PageSchedule::queries);
    for (auto* one : {&pair, &all}) {
        EXPECT_EQ(one->different_answers(camera_rays(vec3(-0.6f, 0, 1.6f), vec3(-0.6f, 0, 0))), 0u);
        const paging::PagingStatistics s = one->server().statistics();
        EXPECT_EQ(s.prefetched_used + s.prefetched_unused > 0, s.slots < s.pages) << s.slots << " " << s.pages;
    }
}

TEST_F(PagingTest, ABatchThatExceedsThePoolReadsNothingAhead) {
    InCoreAgainstPages pair(soup(5000, 0.02f, vec3(1), 3), 20, paging::PageSchedule::set);
    for (int turn = 0; turn < 2; ++turn) {
        EXPECT_EQ(pair.different_answers(camera_rays(vec3(-0.6f, 0, 5), vec3(-0.6f, 0, 0))), 0u);
        EXPECT_EQ(pair.server().statistics().prefetched_used + pair.server().statistics().prefetched_unused, 0u);
    }
}

TEST_F(PagingTest, QueriesFindPagesBeforeTheyAreMissed) {
    using Method = paging::PageQueries::Method;
    const Scene scene = soup(5000, 0.02f, vec3(1), 3);
    const auto run = [&](paging::PageSchedule schedule, Method method) {
        InCoreAgainstPages pair(scene, 1000, schedule, {}, method);
        const std::vector<Ray> rays = camera_rays(pair.tables().bounds, vec3(1, 0.3f, 0.2f));
        EXPECT_EQ(pair.different_answers(rays, nullptr, rays::RayKind::shadow), 0u);
        return pair.server().statistics();
    };
    const paging::PagingStatistics demand = run(paging::PageSchedule::demand, Method::compute);
    EXPECT_EQ(demand.queries, 0u);
    for (const Method method : {Method::compute, Method::raster}) {
        const paging::PagingStatistics queries = run(paging::PageSchedule::queries, method);
        EXPECT_GT(queries.queries, 0u);
        EXPECT_LT(queries.again, demand.again);
    }
}

TEST_F(PagingTest, SmallPoolsAndSlowSourcesChangeNothing) {
    InCoreAgainstPages pair(soup(5000, 0.3f, vec3(1), 3), 4, paging::PageSchedule::set,
                            {.delay = std::chrono::microseconds(30)});
    const std::vector<Ray> rays = rays_through(pair.tables().bounds, 1000, 1);
    for (int turn = 0; turn < 2; ++turn) EXPECT_EQ(pair.different_answers(rays), 0u);
    EXPECT_GT(pair.server().statistics().traffic.evicted, 100u);
}

TEST_F(PagingTest, DamageReachesTheRenderer) {
    for (const std::uint32_t pages : {0u, 7u, 40u}) {
        InCoreAgainstPages pair(soup(5000, 0.1f, vec3(1), 3), 20, paging::PageSchedule::set, {.damaged_after = pages});
        const std::vector<Ray> rays = rays_through(pair.tables().bounds, 2000, 1);
        const std::string message = error_message([&] { pair.different_answers(rays); });
        EXPECT_TRUE(message.starts_with("slow.pages: page ") && message.ends_with(" is damaged")) << message;
    }
}

TEST_F(PagingTest, NoTriangles) {
    InCoreAgainstPages pair(Scene{}, 4);
    const std::vector<Ray> rays{{vec3(0), 0, vec3(0, 0, 1), kInfinity}};
    EXPECT_EQ(pair.different_answers(rays), 0u);
}

}  // namespace
}  // namespace halflight
