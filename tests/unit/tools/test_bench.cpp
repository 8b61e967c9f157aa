// Tests the parts of the benchmark: rays of real passes, interleaved runs, and detection of wrong hits.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <span>
#include <string_view>

#include "engine/io/gltf/gltf.h"
#include "tests/support/gpu_test.h"
#include "tools/measure/bench/capture.h"
#include "tools/measure/bench/frames.h"
#include "tools/measure/bench/measure.h"
#include "tools/measure/bench/treelets.h"

namespace halflight::bench {
namespace {

using shared::Ray;

class BenchRays : public GpuTest {
  protected:
    /// Returns rays of all kinds in a scene of the folder scenes/.
    std::vector<RaySet> rays_of(const std::string& scene_file) {
        Scene scene = load_gltf(std::string(HALFLIGHT_SOURCE_DIR "/scenes/") + scene_file);
        for (Material& m : scene.materials) m.alpha_mode = AlphaMode::opaque;
        const TraceTables tables = build_trace_tables(scene, kFlattenLimit);
        const rays::TraceScene trace(tables);
        diagonal = glm::length(tables.bounds.extent());
        const auto sizes = [&] {
            return std::array{scene.materials.size(), scene.lights.size(), scene.meshes.size(), scene.instances.size()};
        };
        const auto before = sizes();
        std::vector<RaySet> sets =
            capture(context, programs, scene, tables, trace, scene.cameras.front(), kSize, ray_kinds());
        EXPECT_EQ(sizes(), before);
        return sets;
    }

    static constexpr ivec2 kSize{70, 50};  // no multiples of 16
    gpu::ProgramCache programs;
    float diagonal = 0;
};

const RaySet& find(const std::vector<RaySet>& sets, std::string_view kind) {
    return *std::ranges::find(sets, kind, &RaySet::kind);
}

bool live(const Ray& r) {
    return r.t_max >= r.t_min;
}

std::vector<Ray> live_rays(const RaySet& set) {
    std::vector<Ray> rays;
    for (const std::uint32_t path : set.order)
        if (live(set.rays[path])) rays.push_back(set.rays[path]);
    return rays;
}

vec3 end(const Ray& r) {
    return r.origin + r.t_max * r.direction;
}

TEST_F(BenchRays, EveryKindInEveryScene) {
    for (const bool sun : {false, true}) {
        const char* const file = sun ? "atrium.glb" : "cornell.glb";  // sun and sky; area lights only
        SCOPED_TRACE(file);
        const std::vector<RaySet> sets = rays_of(file);
        ASSERT_EQ(sets.size(), ray_kinds().size());
        for (std::size_t k = 0; k < sets.size(); ++k) {
            const RaySet& set = sets[k];
            SCOPED_TRACE(set.kind);
            EXPECT_EQ(set.kind, ray_kinds()[k]);
            EXPECT_EQ(set.rays.size() % 256, 0u);
            EXPECT_GT(set.live, 500u);
            std::vector<std::uint32_t> order = set.order, scanline = set.scanline;
            std::ranges::sort(order);
            std::ranges::sort(scanline);
            EXPECT_EQ(order, scanline);
            EXPECT_EQ(std::ranges::adjacent_find(order), order.end());
            EXPECT_LT(order.back(), set.rays.size());
            const bool in_place = set.any_hit ? set.kind != "ao" : set.kind == "primary";
            EXPECT_EQ(set.listed, !in_place);
            EXPECT_EQ(set.live, static_cast<std::size_t>(std::ranges::count_if(
                                    set.order, [&](std::uint32_t path) { return live(set.rays[path]); })));
            for (const std::uint32_t path : set.order)
                ASSERT_TRUE(!live(set.rays[path]) || glm::dot(set.rays[path].direction, set.rays[path].direction) > 0);
        }
        EXPECT_EQ(find(sets, "primary").live, static_cast<std::size_t>(kSize.x * kSize.y));
        EXPECT_EQ(find(sets, "ao").order, find(sets, "diffuse").order);
        EXPECT_FALSE(find(sets, "ao").order.empty());
        for (const std::uint32_t path : find(sets, "ao").order)
            ASSERT_FLOAT_EQ(find(sets, "ao").rays[path].t_max, 0.05f * diagonal);
        const std::vector<Ray> hard = live_rays(find(sets, "hard"));
        ASSERT_FALSE(hard.empty());
        for (const Ray& ray : hard) {
            if (sun) {
                ASSERT_EQ(ray.direction, hard.front().direction);
                ASSERT_EQ(ray.t_max, kInfinity);
            } else {  // a light was added, because the scene has no punctual one
                ASSERT_LT(glm::distance(end(ray), end(hard.front())), 1e-5f * diagonal);
            }
        }
        if (sun) continue;
        // Connections go from sixteen pixels to one point.
        const RaySet& connections = find(sets, "connection");
        std::size_t groups = 0;
        for (std::size_t first = 0; first < connections.rays.size(); first += 16) {
            const std::span<const Ray> group(&connections.rays[first], 16);
            const auto reference = std::ranges::find_if(group, live);
            groups += reference != group.end();
            for (const Ray& ray : group)
                ASSERT_TRUE(!live(ray) || glm::distance(end(ray), end(*reference)) < 1e-4f * diagonal);
        }
        EXPECT_GT(groups, 500u);
    }
}

TEST(BenchTreelets, HoldEveryTriangleAndFewAtOnce) {
    const Scene scene = load_gltf(HALFLIGHT_SOURCE_DIR "/scenes/still-life.glb");
    for (const std::size_t flatten_limit : {std::size_t{0}, kFlattenLimit}) {
        const TraceTables tables = build_trace_tables(scene, flatten_limit);
        for (const rays::NodeFormat format : {rays::NodeFormat::grid, rays::NodeFormat::floating}) {
            const Treelets treelets(rays::pack_scene(tables, format), tables.triangles.size(), 64);
            std::map<std::uint32_t, int> sizes;
            for (std::uint32_t i = 0; i < tables.triangles.size(); ++i) {
                ASSERT_FALSE(treelets.of(i).empty()) << i;
                for (const std::uint32_t reference : treelets.of(i)) ++sizes[reference];
            }
            EXPECT_EQ(sizes.size(), treelets.count());
            for (const auto& [reference, size] : sizes) EXPECT_LE(size, 64);
            EXPECT_LT(treelets.count(), tables.triangles.size() / 8);
        }
    }
}

Method fixed_method(const std::string& name, bool exact, const Answers& answers, int& runs) {
    return {name, exact, [=, &runs](const RaySet&) -> Prepared {
                return {[&runs] { ++runs; }, [answers] { return answers; }, name + "'s note"};
            }};
}

class BenchMeasure : public GpuTest {};

TEST_F(BenchMeasure, FindsWrongAnswers) {
    RaySet set;
    set.kind = "primary";
    set.rays.assign(256, {vec3(0), 0, vec3(0, 0, 1), kInfinity});
    set.order = {3, 1, 2};
    set.live = 3;
    set.tolerance = 1e-3f;
    Answers right{std::vector<shared::Hit>(256, {kInfinity, 0, 0, shared::kMiss, shared::kMiss}), {}};
    right.hits[1] = {1, 0.25f, 0.25f, 7, 0};
    right.hits[2] = {2, 0.5f, 0.25f, 8, 0};
    Answers near = right, other_triangle = right, elsewhere = right, miss = right;
    near.hits[1].t = std::nextafter(1.0f, 2.0f);
    other_triangle.hits[2].triangle = 9;
    elsewhere.hits[0].t = 5;  // a path that is not in the order
    miss.hits[1] = miss.hits[3];
    int runs = 0;
    const KindResult result =
        measure(set,
                {fixed_method("plain", true, right, runs), fixed_method("near", true, near, runs),
                 fixed_method("near, inexact", false, near, runs), fixed_method("triangle", true, other_triangle, runs),
                 fixed_method("elsewhere", true, elsewhere, runs), fixed_method("miss", false, miss, runs)},
                4, 2, [] {});
    EXPECT_EQ(runs, 6 * (1 + 4 * 2));
    EXPECT_EQ(result.hits, 2u);
    const std::size_t expected[] = {0, 1, 0, 1, 0, 1};
    for (std::size_t m = 0; m < 6; ++m) {
        EXPECT_EQ(result.methods[m].different, expected[m]) << result.methods[m].method;
        EXPECT_EQ(result.methods[m].seconds.size(), 4u);
    }
    EXPECT_EQ(result.methods[1].note, "near's note");
}

TEST(BenchRatios, CompareRunsOfTheSameTurn) {
    // The machine slows down threefold; the ratio of both methods stays 2.
    const Quartiles q = speedup({1, 2, 3}, {2, 4, 6});
    for (const double quartile : {q.lower, q.median, q.upper}) EXPECT_EQ(quartile, 2);
}

}  // namespace
}  // namespace halflight::bench
