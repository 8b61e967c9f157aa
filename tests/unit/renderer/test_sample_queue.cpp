// Tests samples in flight: what is read of them, when, and what happens to samples that nobody waits for. Also tests
// counters of bad values, and predictions of when samples end.
#include <epoxy/gl.h>
#include <gtest/gtest.h>

#include <set>
#include <utility>

#include "passes/picture/bad_values.h"
#include "renderer/sample_pace.h"
#include "renderer/sample_queue.h"
#include "tests/support/error_message.h"
#include "tests/support/gpu_test.h"

namespace halflight {
namespace {

class SampleQueueTest : public GpuTest {
  protected:
    SampleQueueTest() {
        for (std::uint32_t material = 0; material < 4; ++material) tables.triangles.emplace_back(0, 0, 0, material);
    }
    /// Ends a sample whose only path hits the triangle of a material. The next sample overwrites its hits.
    void push(std::uint32_t material, Mattes& to) {
        const shared::Hit hit{.t = 1, .u = 0, .v = 0, .triangle = material, .instance = 0};
        hits.write(std::span(&hit, 1));
        queue.push(&hits, &to);
    }
    /// Returns the materials whose samples were added to mattes.
    std::set<std::string> added(const Mattes& to) const {
        std::array<float, 2 * kCryptomatteRanks> ranks{};
        const Mattes::Layer& layer = to.layers().at(0);
        layer.coverage.rank(0, 1, ranks);
        std::set<std::string> names;
        for (std::size_t i = 0; i < kCryptomatteRanks; ++i)
            for (std::size_t m = 0; m < layer.ids.size(); ++m)
                if (ranks[2 * i] == layer.ids[m] && ranks[2 * i + 1] > 0) names.insert(materials[m]);
        return names;
    }

    using Names = std::set<std::string>;
    const std::vector<std::string> materials{"a", "b", "c", "d"}, layers{"cryptomaterial"};
    TraceTables tables;
    Mattes mattes{tables, {}, materials, layers, 1}, others{tables, {}, materials, layers, 1};
    gpu::Buffer hits{"hits", sizeof(shared::Hit)};
    SampleQueue queue{1};
};

TEST_F(SampleQueueTest, SamplesAreReadInTheirOrder) {
    push(0, mattes);
    EXPECT_EQ(added(mattes), Names());
    push(1, others);
    EXPECT_EQ(added(mattes), Names{"a"}) << "the oldest one makes room";
    push(2, mattes);
    EXPECT_EQ(added(others), Names{"b"});
    queue.push(nullptr, nullptr);  // a sample without hits
    EXPECT_EQ(added(mattes), (Names{"a", "c"}));
    push(3, mattes);
    queue.wait();
    EXPECT_EQ(added(mattes), (Names{"a", "c", "d"}));
    EXPECT_EQ(added(others), Names{"b"});
    queue.wait();
    EXPECT_EQ(added(mattes), (Names{"a", "c", "d"}));
}

TEST_F(SampleQueueTest, BadValuesAreReadWhenTheyAreWanted) {
    const auto shadow_nans = [](const SampleQueue& of) { return of.counted().by_component().at(1).nans; };
    const std::uint32_t three = 3;
    const std::size_t place = shared::kBadKinds + shared::kBadNan;
    queue.bad_values().write(std::span(&three, 1), place);
    queue.push(nullptr, nullptr);
    EXPECT_EQ(shadow_nans(queue), 0u);
    queue.drain();
    EXPECT_EQ(shadow_nans(queue), 3u);
    queue.drain();
    EXPECT_EQ(shadow_nans(queue), 3u);
    queue.reset();
    EXPECT_EQ(shadow_nans(queue), 0u);

    SampleQueue large(std::size_t{1} << 26);  // one sample may fill its counters
    large.bad_values().write(std::span(&three, 1), place);
    large.push(nullptr, nullptr);
    EXPECT_EQ(shadow_nans(large), 3u);
    EXPECT_EQ(large.bad_values().read<std::uint32_t>(place, 1).at(0), 0u);
}

TEST_F(SampleQueueTest, FailuresToWaitAreErrors) {
    push(0, mattes);
    gpu::Context other = test_context();  // this context lacks the fence
    EXPECT_EQ(error_message([&] { queue.wait(); }), "rendering: the driver failed to wait for a sample");
    EXPECT_THROW(other.check("the test"), Error);
    context.make_current();
    EXPECT_EQ(added(mattes), Names());
    queue.reset();
    push(1, mattes);
    queue.wait();
    EXPECT_EQ(added(mattes), Names{"b"});
}

TEST_F(SampleQueueTest, SamplesWithoutAFenceAreErrors) {
    const auto driver = std::exchange(epoxy_glFenceSync, [](GLenum, GLbitfield) -> GLsync { return nullptr; });
    EXPECT_EQ(error_message([&] { push(0, mattes); }), "rendering: the driver failed to make a fence for a sample");
    epoxy_glFenceSync = driver;
    queue.reset();
    push(1, mattes);
    queue.wait();
    EXPECT_EQ(added(mattes), Names{"b"});
}

TEST_F(SampleQueueTest, SamplesInFlightCanBeForgotten) {
    push(0, mattes);
    push(1, mattes);
    queue.reset();
    queue.wait();
    EXPECT_EQ(added(mattes), Names{"a"});
    {
        SampleQueue gone(1);
        gone.push(&hits, &others);
        gone.push(&hits, &others);
    }
    EXPECT_EQ(added(others), Names{"b"});
    push(2, mattes);
    queue.wait();
    EXPECT_EQ(added(mattes), (Names{"a", "c"}));
}

TEST(BadValues, SumsDoNotWrap) {
    BadValueSums sums;
    std::array<std::uint32_t, kBadValueCounts> counts{};
    counts[1 * shared::kBadKinds + shared::kBadNan] = 0xffffffffu;
    counts[1 * shared::kBadKinds + shared::kBadNegative] = 1;
    counts[3 * shared::kBadKinds + shared::kBadInfinite] = 0x80000000u;
    for (int sample = 0; sample < 4; ++sample) sums.add(counts);
    const std::vector<BadValues> bad = sums.by_component();
    ASSERT_EQ(bad.size(), shared::kCountedPasses);
    EXPECT_EQ(bad[1].component, "shadow");
    EXPECT_EQ(bad[1].nans, 4 * 0xffffffffull);
    EXPECT_EQ(bad[1].negatives, 4u);
    EXPECT_EQ(bad[3].infinities, 0x200000000ull);
    EXPECT_EQ(bad[0].total() + bad[2].total(), 0u);
    EXPECT_EQ(bad[1].total(), 4 * 0x100000000ull);
    sums.reset();
    for (const BadValues& n : sums.by_component()) EXPECT_EQ(n.total(), 0u);
}

TEST(SamplePace, ExpectsTheMeanOfSamplesWithoutCompilation) {
    const struct {
        std::vector<std::pair<double, double>> samples;  // seconds, and shaders that were compiled
        double overhead, too_little, enough;
    } cases[] = {{{{2, 0}}, 0, 3.9, 4},
                 {{{2, 0}, {3, 0}}, 0, 4.4, 4.5},
                 {{{3, 1}}, 3, 2.9, 4},  // nothing is known about samples that compile nothing
                 {{{3, 1}, {3.5, 1}}, 2.5, 3.9, 4},
                 {{{1, 1}, {4, 1}}, 0, 0, 100}};  // slow samples after a quick start
    for (const auto& [samples, overhead, too_little, enough] : cases) {
        SamplePace pace;
        for (const auto& [seconds, compiled] : samples) pace.add(seconds, compiled);
        EXPECT_EQ(pace.overhead(), overhead);
        EXPECT_FALSE(pace.another_fits(too_little)) << too_little;
        EXPECT_TRUE(pace.another_fits(enough)) << enough;
    }
    SamplePace slow;
    slow.add(60, 1);
    EXPECT_LT(slow.overhead(), 10) << "one shader does not excuse a long sample";
    EXPECT_FALSE(slow.another_fits(65));
    EXPECT_TRUE(slow.another_fits(115));
}

}  // namespace
}  // namespace halflight
