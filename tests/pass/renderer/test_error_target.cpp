// Tests rendering to an error target, with even and with adaptive samples: it is reached, reported and correct.
// Adaptive samples take fewer, keep the mean, and give equal bits whatever the bands.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <numeric>
#include <utility>

#include "engine/core/error.h"
#include "engine/core/metrics.h"
#include "passes/picture/adaptive.h"
#include "renderer/replicates.h"
#include "tests/pass/renders.h"
#include "tests/pass/scenes.h"
#include "tests/support/gpu_test.h"
#include "tools/measure/common/seed_errors.h"

namespace halflight::test {
namespace {

using Counts = std::vector<std::uint32_t>;

double mean_of_counts(const Counts& counts) {
    return static_cast<double>(std::accumulate(counts.begin(), counts.end(), std::uint64_t{0})) /
           static_cast<double>(counts.size());
}

TEST(ReplicateCounts, FollowTheDeviationsAboveTheirFloors) {
    const std::vector<double> deviations = {0, 0.1, 1, 2, 4, 8};
    const Counts counts = replicate_counts(deviations, 160, 2, 1 << 20);
    EXPECT_LE(mean_of_counts(counts), 160);
    EXPECT_GT(mean_of_counts(counts), 158);
    EXPECT_EQ(counts[0], 20u);  // an eighth of the mean
    EXPECT_EQ(counts[1], 20u);
    for (const std::size_t i : {2u, 3u, 4u}) EXPECT_NEAR(double(counts[i + 1]) / counts[i], 2, 0.02) << i;
}

TEST(ReplicateCounts, NeverFallAsTheMeanGrows) {
    for (const std::vector<double>& deviations : std::vector<std::vector<double>>{
             {0, 0, 0}, {1, 1, 1}, {0, 0, 1e300}, {1e-300, 1, 3}, {5, 0.3, 0.7, 11, 0, 1e-5, 2}}) {
        Counts before(deviations.size(), 0);
        for (std::uint32_t mean = 2; mean < 5000; mean += 1 + mean / 7) {
            const Counts counts = replicate_counts(deviations, mean, 2, 4096);
            EXPECT_LE(mean_of_counts(counts), mean);
            for (std::size_t i = 0; i < counts.size(); ++i) EXPECT_TRUE(counts[i] >= before[i] && counts[i] <= 4096);
            before = counts;
        }
    }
}

TEST(ReplicateCounts, AreEvenAtFirstAndWhereNoiseIsEven) {
    EXPECT_EQ(replicate_counts(std::vector<double>{0, 1, 100}, 2, 2, 1 << 20), Counts(3, 2));
    for (const double d : {0.0, 0.7, 1e-200})
        EXPECT_EQ(replicate_counts(std::vector<double>(3, d), 37, 2, 1 << 20), Counts(3, 37)) << d;
}

TEST(ReplicateSamples, GrowByTheRule) {
    const auto next = [](int samples, double bound, double target) {
        return next_replicate_samples(samples, {.value = 1, .lower = 0, .upper = 0, .bound = bound}, target);
    };
    EXPECT_EQ(next(8, 1.01, 1), 10);
    EXPECT_EQ(next(8, 1.5, 1), 12);
    EXPECT_EQ(next(8, 1e9, 1e-9), 16);
    EXPECT_EQ(next(1, 1.5, 1), 2);
}

TEST(ExpectedSamples, AreThoseOfIndependentSamples) {
    EXPECT_EQ(expected_samples(std::vector<double>{1, 3}, 0.5), 8);
    EXPECT_EQ(expected_samples(std::vector<double>{0, 0}, 0.5), 1);
    EXPECT_EQ(expected_samples(std::vector<double>{1e200, 0}, 0.5), 1000000000);
}

class ErrorTargets : public GpuTest {
  protected:
    /// Returns settings for a small picture. With adaptive samples the box fills a part of it.
    static RenderSettings settings_of(const Scene& of, bool adaptive, double error,
                                      ErrorMetric metric = ErrorMetric::relmse) {
        RenderSettings s = small_settings(of.cameras.at(0), adaptive ? 48 : 24, 32, 1 << 16, 2);
        if (adaptive) s.camera.camera_to_world[3] += dvec4(1.2, 0.9, 2.5, 0);
        s.aovs = {"samples"};
        s.error = ErrorTarget{metric, error};
        s.adaptive = adaptive;
        return s;
    }
    /// Expects that the target is reached, and that the truth is in the interval and below the target as often as it
    /// must be.
    void expect_coverage(const Scene& of, bool adaptive, std::initializer_list<std::pair<ErrorMetric, double>> targets);

    Scene scene = shiny_cornell();
    PreparedScene prepared{context, scene};
    ColorConfig colors = ColorConfig::load();
};

void ErrorTargets::expect_coverage(const Scene& of, bool adaptive,
                                   std::initializer_list<std::pair<ErrorMetric, double>> targets) {
    PreparedScene own(context, of);
    RenderSettings settings = settings_of(of, adaptive, 1);
    settings.adaptive = false;
    settings.error.reset();
    settings.samples =
        1024;  // the noise of this reference moves a true error by 3 %, much less than intervals are wide
    Renderer even(own, colors, settings);
    Image halves[2];
    for (const std::uint32_t half : {0u, 1u}) {
        settings.seed = 1000 + half;
        halves[half] = rgb(even.render(settings).beauty);
    }
    for (const auto& [metric, target] : targets) {
        SCOPED_TRACE(testing::Message() << name(metric) << (adaptive ? ", adaptive" : ", even"));
        FrameSettings frame = settings_of(of, adaptive, target, metric);
        Renderer renderer(own, colors, settings_of(of, adaptive, target, metric));
        const Image weights = metric == ErrorMetric::mse ? Image() : relative_weights(halves[0]);
        int inside = 0, below = 0;
        for (frame.seed = 0; frame.seed < 16; ++frame.seed) {
            const RenderResult result = renderer.render(frame);
            ASSERT_TRUE(result.stats.error);
            const ErrorEstimate& e = result.stats.error->estimate;
            EXPECT_TRUE(result.stats.error->reached);
            EXPECT_LE(e.bound, target);
            EXPECT_TRUE(0 <= e.lower && e.lower < e.value && e.value < e.bound && e.bound < e.upper);
            const Image& samples = layer(result, "samples.Y");
            EXPECT_NEAR(mean_of(samples), result.stats.samples, adaptive ? 1 : 0) << "the mean number is reported";
            if (adaptive) {
                EXPECT_GT(std::ranges::max(samples.pixels), 2 * std::ranges::min(samples.pixels));
            } else {
                EXPECT_EQ(result.stats.samples % kReplicates, 0);
            }
            const std::vector<Image> picture{rgb(result.beauty)};
            const double truth = seed_errors(picture, halves[0], halves[1], weights).mse.value;
            inside += e.lower <= truth && truth <= e.upper;
            below += truth <= target;
        }
        // Fewer than 12 of 16 have a probability of 1 in 1000 at 95 % coverage.
        EXPECT_GE(inside, 12);
        EXPECT_GE(below, 12);
    }
}

TEST_F(ErrorTargets, AreReachedAndCorrect) {
    expect_coverage(scene, false, {{ErrorMetric::relmse, 0.01}, {ErrorMetric::mse, 0.02}});
    expect_coverage(scene, true, {{ErrorMetric::relmse, 0.004}});
    // The edge of a lamp would dominate the squared error: 24 samples of so few pixels may miss it, even or adaptive.
    Scene unlit = cornell_box(diffuse_material(vec3(0.6f)));
    for (Material& material : unlit.materials) material.emission = vec3(0);
    unlit.environment.color = vec3(1);
    expect_coverage(unlit, true, {{ErrorMetric::mse, 0.0002}});
}

TEST_F(ErrorTargets, LowerErrorsTakeMoreSamplesAndAdaptiveOnesFewer) {
    const auto samples = [&](const RenderSettings& settings) {
        const RenderResult result = Renderer(prepared, colors, settings).render();
        EXPECT_TRUE(result.stats.error->reached);
        return result.stats.samples;
    };
    // The ratio is about ten, apart from rounding up.
    EXPECT_GT(samples(settings_of(scene, false, 0.003)), 4 * samples(settings_of(scene, false, 0.03)));
    RenderSettings settings = settings_of(scene, true, 0.002);
    settings.width = settings.height = 96;
    const int adaptive = samples(settings);
    settings.adaptive = false;
    EXPECT_LT(adaptive, 0.8 * samples(settings));
}

// If the number of samples is the limit, nothing but the pilot decides about samples, so there is no bias at all.
// Strips of both widths have standard errors of 2.8 and 2.6 % of the mean. A shift of 15 % is found with a probability
// of 90 %, and one of zero with 6e-5.
TEST_F(ErrorTargets, ThinStripsKeepTheirMean) {
    constexpr int kSide = 32;
    for (const auto& [width, seeds] : {std::pair(1.0 / 16, 450), std::pair(1.0 / 4, 48)}) {  // width: pixels
        const Scene strips = thin_strip(width, kSide);
        PreparedScene of_strips(context, strips);
        RenderSettings settings = small_settings(strips.cameras[0], kSide, kSide, 64, 0);
        settings.adaptive = true;
        settings.error = ErrorTarget{ErrorMetric::relmse, 1e-12};
        settings.aovs = {"samples"};
        Renderer renderer(of_strips, colors, settings);
        double sum = 0, squares = 0, fewest = kSide, most = 0;
        for (int seed = 0; seed < seeds; ++seed) {
            settings.seed = static_cast<std::uint32_t>(seed);
            const RenderResult result = renderer.render(settings);
            const Image& samples = layer(result, "samples.Y");
            fewest = std::min(fewest, double(std::ranges::min(samples.pixels)));
            most = std::max(most, double(std::ranges::max(samples.pixels)));
            double light = 0;
            for (int y = 0; y < 16; ++y)
                for (int x = 0; x < kSide; ++x) light += result.beauty.at(x, y)[0];
            sum += light, squares += light * light;
        }
        EXPECT_GT(most, 2 * fewest);
        const double mean = sum / seeds, error = std::sqrt((squares / seeds - mean * mean) / (seeds - 1));
        EXPECT_GT(error, 0);
        EXPECT_LT(error, 0.03 * 8 * width);
        EXPECT_NEAR(mean, 8 * width, 4 * error) << width;
    }
}

TEST_F(ErrorTargets, EvenBandsReachItTogether) {
    RenderSettings settings = settings_of(scene, false, 0.01);
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

TEST_F(ErrorTargets, BandsChangeNothingOfAdaptivePictures) {
    RenderSettings settings = settings_of(scene, true, 0.004);
    settings.width = 42, settings.height = 58;
    settings.aovs = {"samples", "variance", "albedo", "cryptoobject", "depth"};
    settings.denoise = true;
    std::vector<RenderResult> results;
    for (const int rows : {80, 16, 48}) {
        settings.band_pixels = static_cast<std::size_t>(48 * rows);
        Renderer renderer(prepared, colors, settings);
        results.push_back(renderer.render());
        SCOPED_TRACE(rows);
        expect_same(results.back(), results[0]);
        EXPECT_EQ(results.back().stats.samples, results[0].stats.samples);
        EXPECT_EQ(results.back().stats.error->estimate.value, results[0].stats.error->estimate.value);
        EXPECT_EQ(results.back().stats.error->estimate.bound, results[0].stats.error->estimate.bound);
        if (rows == 16) expect_same(renderer.render(), results[0]);
    }
    const Image& samples = layer(results[0], "samples.Y");
    EXPECT_GT(std::ranges::max(samples.pixels), std::ranges::min(samples.pixels));
    settings.seed = 1;
    EXPECT_NE(Renderer(prepared, colors, settings).render().beauty.pixels, results[0].beauty.pixels);
}

TEST_F(ErrorTargets, EndAtTheirLimits) {
    for (const bool adaptive : {false, true}) {
        SCOPED_TRACE(adaptive);
        RenderSettings settings = settings_of(scene, adaptive, 1e-9);
        settings.samples = adaptive ? 101 : 37;
        Renderer renderer(prepared, colors, settings);
        const RenderResult few = renderer.render();
        const int most = settings.samples / kReplicates * kReplicates;
        EXPECT_LE(few.stats.samples, most);
        EXPECT_GT(few.stats.samples, adaptive ? 80 : most - 1);
        EXPECT_FALSE(few.stats.error->reached);
        EXPECT_GT(few.stats.error->estimate.lower, 1e-9);

        FrameSettings timed = settings;
        timed.time_limit = 1e9;  // the time allows more samples than an int can count
        EXPECT_EQ(renderer.render(timed).stats.samples, few.stats.samples);
        timed.samples = 1 << 20, timed.time_limit = 1e-6;
        EXPECT_EQ(renderer.render(timed).stats.samples, kFirstLook * kReplicates);

        const auto three = [](const RenderProgress& p) { return p.samples_done < 3; };
        const RenderResult stopped = renderer.render(settings, three);
        EXPECT_TRUE(stopped.stats.interrupted);
        EXPECT_FALSE(stopped.stats.error);
    }
}

TEST_F(ErrorTargets, InterruptedPicturesHoldTheSamplesSoFar) {
    for (const std::size_t band_pixels : {48u * 48, 48u * 16}) {
        RenderSettings settings = settings_of(scene, true, 1e-9);
        settings.height = 48;
        settings.samples = 256, settings.band_pixels = band_pixels;
        settings.denoise = true;
        settings.aovs = {"samples", "noisy"};
        Renderer renderer(prepared, colors, settings);
        const RenderResult whole = renderer.render();
        const auto upper_third = [](Image image) {
            image.height /= 3;
            image.pixels.resize(image.pixels.size() / 3);
            return image;
        };
        for (const int reports : {1, 2, 7, 20, 70, 90, 111, 140}) {
            SCOPED_TRACE(reports);
            int left = reports;
            const RenderResult result = renderer.render([&](const RenderProgress&) { return --left > 0; });
            EXPECT_TRUE(result.stats.interrupted);
            EXPECT_FALSE(result.stats.error);
            // Bands that have no sample yet are black.
            for (const auto& [now, all] : {std::pair(layer(result, "noisy.R"), layer(whole, "noisy.R")),
                                           std::pair(rgb(result.beauty), rgb(whole.beauty))})
                for (int c = 0; c < 3; ++c)
                    EXPECT_NEAR(mean_of_pixels(upper_third(now), c).value / mean_of_pixels(upper_third(all), c).value,
                                1, reports < 20 ? 0.25 : 0.1);
        }
    }
}

TEST_F(ErrorTargets, WithoutNoiseThereIsNoError) {
    Scene black;
    black.cameras = scene.cameras;
    for (const bool adaptive : {false, true}) {
        Renderer renderer(context, black, colors, settings_of(black, adaptive, 1e-6));
        const RenderResult result = renderer.render();
        EXPECT_EQ(result.stats.samples, kFirstLook * kReplicates);
        EXPECT_EQ(result.stats.error->estimate.upper, 0);
    }
}

TEST_F(ErrorTargets, InvalidOnesAreRefused) {
    for (const double error : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN(), HUGE_VAL})
        EXPECT_THROW(Renderer(prepared, colors, settings_of(scene, false, error)), Error) << error;
    RenderSettings few = settings_of(scene, false, 1);
    few.samples = kFirstLook * kReplicates - 1;
    EXPECT_THROW(Renderer(prepared, colors, few), Error);
}

}  // namespace
}  // namespace halflight::test
