// Tests rendering to an error target: it is reached, reported, and correct.
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "engine/core/error.h"
#include "renderer/replicates.h"
#include "tests/pass/renders.h"
#include "tests/pass/scenes.h"
#include "tests/support/gpu_test.h"
#include "tools/measure/common/seed_errors.h"

namespace halflight::test {
namespace {

class RenderErrorTest : public GpuTest {
  protected:
    static RenderSettings settings_for(const Scene& scene, double error, ErrorMetric metric = ErrorMetric::relmse) {
        RenderSettings s = small_settings(scene.cameras.at(0), 24, 32, 1 << 16, 2);
        s.aovs = {"samples"};
        s.error = ErrorTarget{metric, error};
        return s;
    }

    Scene scene = shiny_cornell();
    PreparedScene prepared{context, scene};
    ColorConfig colors = ColorConfig::load();
};

TEST_F(RenderErrorTest, IsReachedAndCorrect) {
    Renderer renderer(prepared, colors, settings_for(scene, 0.01));
    FrameSettings reference = settings_for(scene, 1);
    reference.error.reset();
    reference.samples = 2048;
    Image halves[2];
    for (std::uint32_t half : {0u, 1u}) {
        reference.seed = 1000 + half;
        halves[half] = rgb(renderer.render(reference).beauty);
    }
    for (const ErrorMetric metric : {ErrorMetric::relmse, ErrorMetric::mse}) {
        constexpr int kSeeds = 16;
        const double target = metric == ErrorMetric::mse ? 0.02 : 0.01;
        int inside = 0, below = 0;
        for (std::uint32_t seed = 0; seed < kSeeds; ++seed) {
            FrameSettings frame = settings_for(scene, target, metric);
            frame.seed = seed;
            const RenderResult result = renderer.render(frame);
            ASSERT_TRUE(result.stats.error);
            const ErrorEstimate& e = result.stats.error->estimate;
            EXPECT_TRUE(result.stats.error->reached);
            EXPECT_LE(e.bound, target);
            EXPECT_TRUE(0 <= e.lower && e.lower < e.value && e.value < e.bound && e.bound < e.upper);
            EXPECT_EQ(result.stats.samples % kReplicates, 0);
            EXPECT_EQ(*layer(result, "samples.Y").at(3, 3), static_cast<float>(result.stats.samples));
            const std::vector<Image> picture{rgb(result.beauty)};
            const Image weights = metric == ErrorMetric::mse ? Image() : relative_weights(halves[0]);
            const double truth = seed_errors(picture, halves[0], halves[1], weights).mse.value;
            inside += e.lower <= truth && truth <= e.upper;
            below += truth <= target;
        }
        // Fewer than 12 of 16 have a probability of 1 in 1000 at 95 % coverage.
        EXPECT_GE(inside, 12) << name(metric);
        EXPECT_GE(below, 12) << name(metric);
    }
}

TEST_F(RenderErrorTest, LowerErrorsTakeMoreSamples) {
    Renderer renderer(prepared, colors, settings_for(scene, 1));
    int samples[2] = {};
    for (const int i : {0, 1}) {
        const RenderResult result = renderer.render(settings_for(scene, i == 0 ? 0.03 : 0.003));
        samples[i] = result.stats.samples;
        EXPECT_TRUE(result.stats.error->reached);
    }
    EXPECT_GT(samples[1], 4 * samples[0]);  // the ratio is about ten, apart from rounding up
}

TEST_F(RenderErrorTest, BandsReachItTogether) {
    RenderSettings settings = settings_for(scene, 0.01);
    settings.band_pixels = 32 * 16;
    Renderer renderer(prepared, colors, settings);
    const RenderResult result = renderer.render(), again = renderer.render();
    EXPECT_TRUE(result.stats.error->reached);
    expect_same(result, again);
    EXPECT_EQ(result.stats.error->estimate.value, again.stats.error->estimate.value);
    // Each band takes the samples that it needs.
    const Image& samples = layer(result, "samples.Y");
    EXPECT_EQ(static_cast<int>(std::ranges::min(samples.pixels)), result.stats.samples);
    EXPECT_EQ(*samples.at(0, 0), *samples.at(23, 15));
    EXPECT_EQ(*samples.at(0, 16), *samples.at(23, 31));
}

TEST_F(RenderErrorTest, EndsAtItsLimits) {
    RenderSettings settings = settings_for(scene, 1e-9);
    settings.samples = 37;
    Renderer renderer(prepared, colors, settings);
    const RenderResult few = renderer.render();
    EXPECT_EQ(few.stats.samples, 32);  // the last multiple of kReplicates
    EXPECT_FALSE(few.stats.error->reached);
    EXPECT_GT(few.stats.error->estimate.lower, 1e-9);

    FrameSettings timed = settings;
    timed.time_limit = 1e9;  // the time allows more samples than an int can count
    EXPECT_EQ(renderer.render(timed).stats.samples, few.stats.samples);
    timed.samples = 1 << 20, timed.time_limit = 1e-6;
    EXPECT_EQ(renderer.render(timed).stats.samples, kFirstLook * kReplicates);

    const RenderResult stopped = renderer.render(settings, [](const RenderProgress& p) { return p.samples_done < 3; });
    EXPECT_TRUE(stopped.stats.interrupted);
    EXPECT_FALSE(stopped.stats.error);
}

TEST_F(RenderErrorTest, WithoutNoiseThereIsNoError) {
    Scene black;
    black.cameras = scene.cameras;
    Renderer renderer(context, black, colors, settings_for(black, 1e-6));
    const RenderResult result = renderer.render();
    EXPECT_EQ(result.stats.samples, kFirstLook * kReplicates);
    EXPECT_EQ(result.stats.error->estimate.upper, 0);
}

TEST_F(RenderErrorTest, InvalidTargetsAreRefused) {
    for (const double error : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN(), HUGE_VAL})
        EXPECT_THROW(Renderer(prepared, colors, settings_for(scene, error)), Error) << error;
    RenderSettings few = settings_for(scene, 1);
    few.samples = kFirstLook * kReplicates - 1;
    EXPECT_THROW(Renderer(prepared, colors, few), Error);
}

TEST(ReplicateSamples, GrowByTheRule) {
    EXPECT_EQ(next_replicate_samples(8, {.value = 1, .lower = 0, .upper = 0, .bound = 1.01}, 1), 10);
    EXPECT_EQ(next_replicate_samples(8, {.value = 1, .lower = 0, .upper = 0, .bound = 1.5}, 1), 12);
    EXPECT_EQ(next_replicate_samples(8, {.value = 1, .lower = 0, .upper = 0, .bound = 1e9}, 1e-9), 16);
    EXPECT_EQ(next_replicate_samples(1, {.value = 1, .lower = 0, .upper = 0, .bound = 1.5}, 1), 2);
}

}  // namespace
}  // namespace halflight::test
