// Tests adaptive sampling: numbers of samples, no bias, smaller errors, equal bits whatever the bands.
#include "passes/picture/adaptive.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>

#include "engine/core/error.h"
#include "engine/core/metrics.h"
#include "tests/pass/renders.h"
#include "tests/pass/scenes.h"
#include "tests/support/error_message.h"
#include "tests/support/gpu_test.h"

namespace halflight::test {
namespace {

using Counts = std::vector<std::uint32_t>;

std::uint64_t sum_of(const Counts& counts) {
    return std::accumulate(counts.begin(), counts.end(), std::uint64_t{0});
}

TEST(AdaptiveCounts, ArePowersOfTwoNearTheTotal) {
    constexpr float kNaN = std::numeric_limits<float>::quiet_NaN(), kInf = std::numeric_limits<float>::infinity();
    const std::vector<std::vector<float>> cases = {{0, 0, 0, 0, 0, 0},
                                                   {1, 1, 1, 1, 1, 1},
                                                   {0, 0, 0, 0, 0, 1e30f},
                                                   {kNaN, 1, kInf, 0, 2, 1e-30f},
                                                   {5, 0, 0, 0, 0, 0}};
    for (const std::vector<float>& errors : cases) {
        for (const std::uint32_t samples : {16u, 57u, 4096u}) {
            const Counts counts = adaptive_counts(errors, ivec2(3, 2), 4, 6 * samples);
            for (const std::uint32_t n : counts) EXPECT_TRUE(n >= 4 && std::has_single_bit(n)) << n;
            EXPECT_LE(std::abs(double(sum_of(counts)) - 6.0 * samples), std::ranges::max(counts));
        }
    }
}

TEST(AdaptiveCounts, EvenNoiseGivesEvenNumbers) {
    for (const float error : {0.0f, 0.3f}) {
        const Counts counts = adaptive_counts(std::vector<float>(40, error), ivec2(8, 5), 4, 40 * 64);
        EXPECT_EQ(counts, Counts(40, 64));
    }
}

TEST(AdaptiveCounts, FollowTheSquareRootOfTheError) {
    // Blocks far from the border between the two halves have neighbours with the same error.
    std::vector<float> errors(40 * 40, 1.0f);
    for (std::size_t i = 0; i < errors.size(); ++i)
        if (i % 40 >= 20) errors[i] = 16;
    const Counts counts = adaptive_counts(errors, ivec2(40, 40), 4, 40 * 40 * 100);
    double left = 0, right = 0;
    for (std::size_t i = 0; i < counts.size(); ++i) {
        if (i % 40 < 15) left += counts[i];
        if (i % 40 >= 25) right += counts[i];
    }
    EXPECT_NEAR(right / left, 4, 0.3);
}

TEST(AdaptiveCounts, LeaveNoBlockOut) {
    std::vector<float> errors(64, 0.0f);
    errors[0] = 1;
    const Counts counts = adaptive_counts(errors, ivec2(8, 8), 8, 64 * 100);
    EXPECT_EQ(std::ranges::min(counts), 8u);
    EXPECT_GT(counts[0], 1000u);
}

TEST(AdaptiveCounts, NumbersOfFirstSamples) {
    EXPECT_EQ(pilot_samples(16), 4);
    EXPECT_EQ(pilot_samples(128), 8);
    EXPECT_EQ(pilot_samples(1 << 20), 32);
    EXPECT_EQ(least_samples(16), 4);
    EXPECT_EQ(least_samples(127), 8);
    EXPECT_EQ(least_samples(128), 16);
}

class AdaptiveTest : public GpuTest {
  protected:
    /// Returns settings for a picture of a Cornell box that fills a part of it.
    static RenderSettings settings_of(const Scene& scene, int side, int samples) {
        RenderSettings s = small_settings(scene.cameras[0], side, side, samples, 3);
        s.camera.camera_to_world[3] += dvec4(1.2, 0.9, 2.5, 0);
        s.aovs.emplace_back("samples");
        return s;
    }
    RenderResult render(PreparedScene& prepared, RenderSettings settings, bool adaptive) {
        settings.adaptive = adaptive;
        return Renderer(prepared, colors, settings).render();
    }
    ColorConfig colors = ColorConfig::load();
};

double relative_error(const Image& image, const Image& reference) {
    return mean_of(relative_squared_error_map(rgb(image), rgb(reference)));
}

TEST_F(AdaptiveTest, ErrorsAreSmallerAtAsManySamples) {
    const Scene scene = shiny_cornell();
    PreparedScene prepared(context, scene);
    RenderSettings settings = settings_of(scene, 96, 32);
    const RenderResult even = render(prepared, settings, false), adaptive = render(prepared, settings, true);
    const Image& samples = layer(adaptive, "samples.Y");
    EXPECT_NEAR(mean_of(samples), 32, 2);
    EXPECT_GT(std::ranges::max(samples.pixels), 2 * std::ranges::min(samples.pixels));
    EXPECT_TRUE(adaptive.stats.biases.empty());
    settings.samples = 1024, settings.seed = 5;
    const Image reference = render(prepared, settings, false).beauty;
    EXPECT_LT(relative_error(adaptive.beauty, reference), 0.8 * relative_error(even.beauty, reference));
}

TEST_F(AdaptiveTest, MeansAreUnbiased) {
    constexpr int kSeeds = 48, kSide = 32, kBlock = 4;
    constexpr std::size_t kBlocks = (kSide / kBlock) * (kSide / kBlock) * 3;
    const Scene scene = shiny_cornell();
    PreparedScene prepared(context, scene);
    RenderSettings settings = settings_of(scene, kSide, 16);
    std::vector<double> sums[2], squares[2];
    for (const int adaptive : {0, 1}) {
        sums[adaptive].assign(kBlocks, 0), squares[adaptive].assign(kBlocks, 0);
        for (int seed = 0; seed < kSeeds; ++seed) {
            settings.seed = static_cast<std::uint32_t>(2 * seed + adaptive);
            const Image picture = render(prepared, settings, adaptive == 1).beauty;
            std::vector<double> blocks(kBlocks);
            for (int y = 0; y < kSide; ++y)
                for (int x = 0; x < kSide; ++x)
                    for (int c = 0; c < 3; ++c)
                        blocks[std::size_t((y / kBlock * (kSide / kBlock) + x / kBlock) * 3 + c)] +=
                            picture.at(x, y)[c];
            for (std::size_t b = 0; b < kBlocks; ++b)
                sums[adaptive][b] += blocks[b], squares[adaptive][b] += blocks[b] * blocks[b];
        }
    }
    double chi2 = 0;
    int tested = 0;
    for (std::size_t b = 0; b < kBlocks; ++b) {
        double difference = 0, variance = 0;
        for (const int i : {0, 1}) {
            const double mean = sums[i][b] / kSeeds;
            difference += (i == 0 ? 1 : -1) * mean;
            variance += std::max(squares[i][b] / kSeeds - mean * mean, 0.0) / (kSeeds - 1);
        }
        if (!(variance > 0)) {
            EXPECT_NEAR(difference, 0, 1e-4) << b;
            continue;
        }
        ++tested;
        chi2 += difference * difference / variance;
        EXPECT_LT(std::abs(difference) / std::sqrt(variance), 4.5) << "block " << b;
    }
    EXPECT_GT(tested, 20);
    EXPECT_LT(chi2 / tested, 1.8) << "channels of a block are correlated";
}

// A thin strip is met by few samples. Its mean is known, and a number of samples that depends on the hits would show.
TEST_F(AdaptiveTest, ThinStripsKeepTheirMean) {
    constexpr int kSeeds = 600, kSide = 32;
    for (const double width : {1.0 / 16, 1.0 / 4}) {  // pixels
        const Scene scene = thin_strip(width, kSide);
        PreparedScene prepared(context, scene);
        RenderSettings settings = small_settings(scene.cameras[0], kSide, kSide, 64, 0);
        settings.adaptive = true;
        Renderer renderer(prepared, colors, settings);
        double sum = 0, squares = 0;
        for (int seed = 0; seed < kSeeds; ++seed) {
            settings.seed = static_cast<std::uint32_t>(seed);
            const Image picture = renderer.render(settings).beauty;
            double light = 0;
            for (int y = 0; y < 16; ++y)
                for (int x = 0; x < kSide; ++x) light += picture.at(x, y)[0];
            sum += light, squares += light * light;
        }
        const double mean = sum / kSeeds, error = std::sqrt((squares / kSeeds - mean * mean) / (kSeeds - 1));
        EXPECT_GT(error, 0);
        EXPECT_LT(error, 0.02 * 8 * width);
        EXPECT_NEAR(mean, 8 * width, 4 * error) << width;
    }
}

TEST_F(AdaptiveTest, InterruptedPicturesHoldTheSamplesSoFar) {
    const Scene scene = shiny_cornell();
    PreparedScene prepared(context, scene);
    RenderSettings settings = settings_of(scene, 48, 64);
    const Image even = render(prepared, settings, false).beauty;
    settings.adaptive = true;
    Renderer renderer(prepared, colors, settings);
    for (const int reports : {1, 2, 6, 11, 40, 1}) {
        int left = reports;
        const RenderResult result = renderer.render([&](const RenderProgress&) { return --left > 0; });
        EXPECT_TRUE(result.stats.interrupted);
        EXPECT_GE(result.stats.samples, 1) << reports;
        EXPECT_GE(std::ranges::min(layer(result, "samples.Y").pixels), 1);
        for (int c = 0; c < 3; ++c)
            EXPECT_NEAR(mean_of_pixels(result.beauty, c).value / mean_of_pixels(even, c).value, 1, 0.2) << reports;
    }
    EXPECT_FALSE(renderer.render().stats.interrupted);
}

TEST_F(AdaptiveTest, ACallbackThatStopsIsNotAskedAgain) {
    const Scene scene = shiny_cornell();
    PreparedScene prepared(context, scene);
    for (const bool to_error : {false, true}) {
        RenderSettings settings = settings_of(scene, 48, 64);
        settings.adaptive = true;
        settings.band_pixels = 48 * 32;
        if (to_error) settings.error = ErrorTarget{ErrorMetric::relmse, 1e-4};
        Renderer renderer(prepared, colors, settings);
        for (const int stopped : {1, 3, 10}) {
            int asked = 0;
            const RenderResult result = renderer.render([&](const RenderProgress&) { return ++asked != stopped; });
            EXPECT_TRUE(result.stats.interrupted);
            EXPECT_EQ(asked, stopped) << to_error;
        }
    }
}

// Light that all samples of a pixel agree about is found exactly, whatever the numbers of samples.
TEST_F(AdaptiveTest, EvenLightStaysEven) {
    Scene scene = cornell_box();
    for (Material& material : scene.materials) material.base_color = vec4(0, 0, 0, 1), material.emission = vec3(0.75f);
    scene.environment.color = vec3(0.75f);
    PreparedScene prepared(context, scene);
    RenderSettings settings = small_settings(scene.cameras[0], 48, 48, 19, 2);
    const RenderResult adaptive = render(prepared, settings, true), even = render(prepared, settings, false);
    for (std::size_t i = 0; i < even.beauty.pixels.size(); ++i)
        ASSERT_NEAR(adaptive.beauty.pixels[i], even.beauty.pixels[i], 1e-6) << i;
}

TEST_F(AdaptiveTest, VarianceIsThatOfTheMean) {
    constexpr int kSeeds = 24;
    const Scene scene = shiny_cornell();
    PreparedScene prepared(context, scene);
    RenderSettings settings = settings_of(scene, 32, 32);
    std::vector<double> sum, square;
    double claimed = 0;
    for (int seed = 0; seed < kSeeds; ++seed) {
        settings.seed = static_cast<std::uint32_t>(seed);
        const RenderResult result = render(prepared, settings, true);
        const Image picture = rgb(result.beauty);
        sum.resize(picture.pixels.size()), square.resize(picture.pixels.size());
        for (std::size_t i = 0; i < picture.pixels.size(); ++i)
            sum[i] += picture.pixels[i], square[i] += double(picture.pixels[i]) * picture.pixels[i];
        claimed += mean_of(layer(result, "variance.R")) / kSeeds;
    }
    double found = 0;
    for (std::size_t i = 0; i < sum.size(); ++i)
        found += (square[i] - sum[i] * sum[i] / kSeeds) / (kSeeds - 1) / double(sum.size());
    // The layer takes samples as independent, and well distributed ones are better.
    EXPECT_LT(found, 1.3 * claimed);
    EXPECT_GT(found, 0.1 * claimed);
}

TEST_F(AdaptiveTest, BandsChangeNothing) {
    Scene scene = pyramids();
    Material veil = diffuse_material(vec3(0.7f));
    veil.alpha_mode = AlphaMode::blend;
    veil.base_color.a = 0.4f;
    const Camera camera = camera_on_pyramids();
    const dvec3 eye(camera.camera_to_world[3]), ahead(-camera.camera_to_world[2]);
    const vec3 right(camera.camera_to_world[0]), up(camera.camera_to_world[1]);
    const int material = add_material(scene, veil);
    for (const double distance : {1.0, 1.1})
        add_quad(scene, material, vec3(eye + distance * ahead) - right - up, 2.0f * right, 2.0f * up);
    scene.environment.color = vec3(1);
    scene.cameras = {camera};
    RenderSettings settings = all_settings(scene, 70, 90, 18);
    settings.adaptive = true;
    settings.bounces = 3;
    settings.denoise = true;
    const auto in_bands = [&](int rows) {
        settings.band_pixels = static_cast<std::size_t>(80 * rows);
        return test::render(context, scene, settings);
    };
    const RenderResult whole = in_bands(105);
    EXPECT_GT(std::ranges::max(layer(whole, "samples.Y").pixels), std::ranges::min(layer(whole, "samples.Y").pixels));
    for (const int rows : {16, 48}) {
        SCOPED_TRACE(rows);
        expect_same(in_bands(rows), whole);
    }
}

TEST_F(AdaptiveTest, DenoisedPicturesGain) {
    const Scene scene = shiny_cornell();
    PreparedScene prepared(context, scene);
    RenderSettings settings = settings_of(scene, 96, 32);
    settings.denoise = true;
    const RenderResult denoised = render(prepared, settings, true);
    settings.denoise = false;
    const RenderResult noisy = render(prepared, settings, true);
    settings.samples = 1024, settings.seed = 5;
    const Image reference = render(prepared, settings, false).beauty;
    EXPECT_LT(relative_error(denoised.beauty, reference), 0.5 * relative_error(noisy.beauty, reference));
    for (int c = 0; c < 3; ++c)
        EXPECT_NEAR(mean_of_pixels(denoised.beauty, c).value / mean_of_pixels(noisy.beauty, c).value, 1, 0.01);
}

TEST_F(AdaptiveTest, SettingsThatDoNotFitAreRefused) {
    const Scene scene = shiny_cornell();
    RenderSettings settings = settings_of(scene, 16, 15);
    settings.adaptive = true;
    const auto problem = [&](const RenderSettings& s) {
        return error_message([&] { test::render(context, scene, s); });
    };
    EXPECT_EQ(problem(settings), "render settings: adaptive sampling takes at least 16 samples");
    settings.samples = 16;
    settings.time_limit = 1;
    EXPECT_EQ(problem(settings), "render settings: adaptive sampling takes a time limit only with an error target");
    settings.time_limit = 0;
    settings.preview.filter = true;
    EXPECT_EQ(problem(settings), "render settings: adaptive sampling cannot be combined with a preview mode");
    settings.preview.filter = false;
    settings.first_sample = 16;
    EXPECT_EQ(problem(settings), "render settings: a picture with adaptive sampling must begin with the first sample");
    settings.first_sample = 0;
    settings.estimator.sampler = SamplePoints::blue_noise;
    EXPECT_EQ(problem(settings), "render settings: adaptive sampling needs the sampler sobol");
}

}  // namespace
}  // namespace halflight::test
