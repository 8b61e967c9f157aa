// Tests the choice of the tracing method: the requested one, or the fastest one by measurement. Hits are always equal.
#include <gtest/gtest.h>

#include <numeric>

#include "engine/core/error.h"
#include "tests/pass/rays/tracer_harness.h"
#include "tests/pass/rays/tracer_inputs.h"
#include "tests/support/gpu_test.h"

namespace halflight {
namespace {

using namespace test;
using rays::BatchStatistics;
using rays::Culling;
using rays::TraceMethod;

constexpr std::uint32_t kRays = 64 * 64;

class TracerChoice : public GpuTest {
  protected:
    /// Runs one batch of a kind.
    std::vector<Hit> closest(rays::Tracer& tracer, rays::RayKind kind = rays::RayKind::primary,
                             const std::vector<std::uint32_t>* list = nullptr) {
        return closest_hits(executor, {view, list, nullptr, kind}, tracer);
    }
    static BatchStatistics only(const rays::Tracer& tracer) {
        const std::vector<BatchStatistics> all = tracer.statistics();
        EXPECT_EQ(all.size(), 1u);
        return all.at(0);
    }
    static const BatchStatistics::Measured& measured(const BatchStatistics& s, TraceMethod method) {
        return s.measured[static_cast<std::size_t>(method)];
    }

    const TraceTables tables = build_trace_tables(soup(2000, 0.08f, vec3(1), 3));
    rays::TraceScene scene{tables};
    const std::vector<Ray> view = camera_rays(vec3(0.1f, 0.2f, 2), vec3(0));
    gpu::ProgramCache programs;
    graph::Executor executor{programs};
};

TEST_F(TracerChoice, ShortRendersStayPlain) {
    rays::Tracer tracer(scene, Culling::automatic);
    for (int run = 1; run <= 3; ++run) {
        closest(tracer);
        EXPECT_EQ(measured(only(tracer), TraceMethod::plain).runs, static_cast<std::uint64_t>(run));
        EXPECT_EQ(measured(only(tracer), TraceMethod::tiles).runs, 0u);
    }
    EXPECT_EQ(only(tracer).batch, "primary");
}

// The times on the machine decide whether one method is clearly faster and gets most runs. test_choice tests the
// consequences of given times.
TEST_F(TracerChoice, LongRendersTryBothMethodsAndReportTheFasterOne) {
    rays::Tracer off(scene), tracer(scene, Culling::automatic);
    const std::vector<Hit> hits = closest(off);
    for (int run = 0; run < 150; ++run) ASSERT_EQ(different(closest(tracer), hits), 0u) << run;
    const BatchStatistics s = only(tracer);
    const auto &plain = measured(s, TraceMethod::plain), &tiles = measured(s, TraceMethod::tiles);
    EXPECT_EQ(plain.runs + tiles.runs, 150u);
    EXPECT_GE(std::min(plain.runs, tiles.runs), 2u);
    for (const auto* m : {&plain, &tiles}) {
        EXPECT_GT(m->best, 0);
        EXPECT_GE(m->timed, 2u);
        EXPECT_LE(m->timed, 20u);  // few, because timing waits for the GPU
        EXPECT_GE(m->seconds, m->best * static_cast<double>(m->timed) * (1 - 1e-9));
    }
    EXPECT_EQ(s.tiles, tiles.runs * kRays / 64);
    EXPECT_EQ(s.tiles_culled, kRays / 64);  // the rays did not change

    tracer.invalidate();
    EXPECT_EQ(only(tracer).method, TraceMethod::plain);
    EXPECT_EQ(measured(only(tracer), TraceMethod::tiles).runs, tiles.runs) << "invalidation keeps the sums";
    tracer.reset_statistics();
    EXPECT_EQ(measured(only(tracer), TraceMethod::tiles).runs, 0u);
    EXPECT_EQ(only(tracer).tiles + only(tracer).tiles_culled, 0u);
}

TEST_F(TracerChoice, RaysOfListsStayPlain) {
    rays::Tracer tracer(scene, Culling::automatic);
    std::vector<std::uint32_t> list(1000);
    std::iota(list.begin(), list.end(), 7u);
    for (int run = 0; run < 10; ++run) closest(tracer, rays::RayKind::continuation, &list);
    EXPECT_EQ(only(tracer).method, TraceMethod::plain);
    EXPECT_EQ(executor.history().bytes(), 0u);
}

TEST_F(TracerChoice, RequestedMethodsAreUsed) {
    rays::Tracer off(scene), compute(scene, Culling::compute);
    const std::vector<Hit> hits = closest(off);
    EXPECT_EQ(only(off).method, TraceMethod::plain);
    EXPECT_EQ(executor.history().bytes(), 0u);

    EXPECT_EQ(different(closest(compute), hits), 0u);
    EXPECT_EQ(different(closest(compute), hits), 0u);
    const BatchStatistics s = only(compute);
    EXPECT_EQ(s.method, TraceMethod::tiles);
    EXPECT_EQ(measured(s, TraceMethod::tiles).runs, 2u);
    EXPECT_EQ(measured(s, TraceMethod::plain).runs, 0u);
    EXPECT_EQ(s.tiles, 2 * kRays / 64);
    EXPECT_EQ(s.tiles_culled, kRays / 64);
    EXPECT_GT(s.state_bytes, 0u);
    EXPECT_EQ(executor.history().bytes(), s.state_bytes);

    const rays::PackedScene packed = rays::pack_scene(tables);
    const rays::TraceScene same(tables, packed, {});
    rays::RasterCulling state(packed);
    rays::Tracer raster(same, state);
    EXPECT_EQ(different(closest(raster), hits), 0u);
    EXPECT_EQ(only(raster).method, TraceMethod::raster);
    EXPECT_THROW(rays::Tracer(scene, Culling::raster), Error) << "it is a server";
}

TEST_F(TracerChoice, EveryKindIsItsOwnBatch) {
    rays::Tracer tracer(scene, Culling::compute);
    closest(tracer);
    closest(tracer, rays::RayKind::glossy);
    closest(tracer, rays::RayKind::glossy);
    const std::vector<BatchStatistics> all = tracer.statistics();
    ASSERT_EQ(all.size(), 2u);
    for (const BatchStatistics& s : all) EXPECT_EQ(measured(s, TraceMethod::tiles).runs, s.batch == "glossy" ? 2u : 1u);
    // Two batches of the same kind and depth would share their lists.
    const auto twice = [&](graph::Graph& graph, const rays::RayBatch& batch, auto results) {
        results = closest_hit(graph, tracer, batch, results);
        return closest_hit(graph, tracer, batch, results);
    };
    EXPECT_THROW(run_trace<Hit>(executor, {view}, twice), Error);
}

// Boxes of missing children are empty, and a shaft as wide as the scene meets an empty box.
TEST_F(TracerChoice, ListsHoldExistingNodesOnly) {
    const TraceTables alone = build_trace_tables(soup(1, 1, vec3(1), 3));
    const rays::TraceScene one(alone);
    rays::Tracer tracer(one, Culling::compute);
    tracer.count();
    const std::vector<Ray> around = mixed_rays(alone.bounds, kRays);
    closest_hits(executor, {around}, tracer);
    const BatchStatistics::Lists lists = only(tracer).lists;
    EXPECT_GT(lists.entries, lists.tiles / 2);
    EXPECT_LE(lists.entries, lists.tiles) << "there is only one leaf";
}

}  // namespace
}  // namespace halflight
