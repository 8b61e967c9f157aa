// Tests adaptive sampling: numbers of samples, no bias, smaller errors, equal bits whatever the bands.
#include "passes/picture/adaptive.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>

#include "tests/pass/picture/cornell_test.h"
#include "tests/pass/rays/batches.h"

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

class AdaptiveTest : public CornellTest {
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
};

TEST_F(AdaptiveTest, ErrorsAreSmallerAtAsManySamples) {
    RenderSettings settings = settings_of(cornell, 96, 32);
    settings.aovs.insert(settings.aovs.end(), {"noisy", "albedo", "normal"});
    const RenderResult even = render(prepared_cornell, settings, false);
    settings.denoise = true;
    const RenderResult adaptive = render(prepared_cornell, settings, true);
    const Image &samples = layer(adaptive, "samples.Y"), &noisy = layer(adaptive, "noisy.R");
    EXPECT_NEAR(mean_of(samples), 32, 2);
    EXPECT_GT(std::ranges::max(samples.pixels), 2 * std::ranges::min(samples.pixels));
    EXPECT_EQ(adaptive.stats.biases.size(), 1u) << "denoising alone is a bias";
    for (int c = 0; c < 3; ++c)
        EXPECT_NEAR(mean_of_pixels(adaptive.beauty, c).value / mean_of_pixels(noisy, c).value, 1, 0.01);
    for (const char* features : {"albedo.R", "normal.X"}) {
        // Pixels of one surface have the same features in each sample.
        const Image &a = layer(adaptive, features), &e = layer(even, features);
        std::size_t surfaces = 0, differ = 0;
        for (std::size_t i = 0; i < a.pixels.size(); ++i) {
            surfaces += e.pixels[i] != 0;
            differ += std::abs(a.pixels[i] - e.pixels[i]) > 1e-3f;
        }
        EXPECT_LT(differ, surfaces / 4) << features;
    }
    settings.denoise = false, settings.samples = 512, settings.seed = 5;
    const Image reference = render(prepared_cornell, settings, false).beauty;
    const double noise = relative_error(noisy, reference);
    EXPECT_LT(noise, 0.8 * relative_error(even.beauty, reference));
    EXPECT_LT(relative_error(adaptive.beauty, reference), 0.5 * noise) << "denoised";
}

/// A shift of all means by a third of a block's noise in one picture shows, and one of a single block by 1.5 times it.
TEST_F(AdaptiveTest, MeansAreUnbiasedAndTheirVarianceIsKnown) {
    constexpr int kSeeds = 32, kSide = 32;
    RenderSettings settings = settings_of(cornell, kSide, 16);
    Batches blocks[2], pixels;
    double claimed = 0;
    for (const int adaptive : {0, 1}) {
        settings.adaptive = adaptive == 1;
        Renderer renderer(prepared_cornell, colors, settings);
        for (int seed = 0; seed < kSeeds; ++seed) {
            settings.seed = static_cast<std::uint32_t>(2 * seed + adaptive);
            const RenderResult result = renderer.render(settings);
            blocks[adaptive].add(block_means(rgb(result.beauty), 4));
            if (adaptive == 0) continue;
            pixels.add(rgb(result.beauty));
            claimed += mean_of(layer(result, "variance.R")) / kSeeds;
        }
    }
    EXPECT_TRUE(agree("adaptive", blocks[1].estimate(), blocks[0].estimate(), {.p_value = 1e-5}));
    // The layer takes samples as independent, and well distributed ones are better.
    EXPECT_LT(pixels.variance(), 1.3 * claimed);
    EXPECT_GT(pixels.variance(), 0.1 * claimed);
}

/// A thin strip is met by few samples. Its mean is known. A number of samples that depends on the hits would show
/// if it shifted the mean by 12 %: the bound is at most 8 %, and the standard error 2 %.
TEST_F(AdaptiveTest, ThinStripsKeepTheirMean) {
    constexpr int kSide = 32;
    for (const auto& [width, seeds] : {std::pair(1.0 / 16, 340), std::pair(1.0 / 4, 80)}) {  // width: pixels
        const Scene scene = thin_strip(width, kSide);
        PreparedScene prepared(context, scene);
        RenderSettings settings = small_settings(scene.cameras[0], kSide, kSide, 64, 0);
        settings.adaptive = true;
        Renderer renderer(prepared, colors, settings);
        double sum = 0, squares = 0;
        for (int seed = 0; seed < seeds; ++seed) {
            settings.seed = static_cast<std::uint32_t>(seed);
            const Image picture = renderer.render(settings).beauty;
            double light = 0;
            for (const auto& [x, y] : pixels_of({kSide, 16})) light += picture.at(x, y)[0];
            sum += light, squares += light * light;
        }
        const double mean = sum / seeds, error = std::sqrt((squares / seeds - mean * mean) / (seeds - 1));
        EXPECT_GT(error, 0);
        EXPECT_LT(error, 0.02 * 8 * width);
        EXPECT_NEAR(mean, 8 * width, 4 * error) << width;
    }
}

TEST_F(AdaptiveTest, InterruptedPicturesHoldTheSamplesSoFar) {
    RenderSettings settings = settings_of(cornell, 48, 64);
    const Image even = render(prepared_cornell, settings, false).beauty;
    settings.adaptive = true;
    for (const auto& [bands, to_error] : {std::pair(1, false), std::pair(2, false), std::pair(2, true)}) {
        settings.band_pixels = static_cast<std::size_t>(48 * (bands == 1 ? 48 : 32));
        if (to_error) settings.error = ErrorTarget{ErrorMetric::relmse, 1e-4};
        Renderer renderer(prepared_cornell, colors, settings);
        for (const int stopped : {1, 3, 10, 40, 1}) {
            SCOPED_TRACE(fmt::format("{} bands, {}, stopped at {}", bands, to_error, stopped));
            int asked = 0;
            const RenderResult result = renderer.render([&](const RenderProgress&) { return ++asked != stopped; });
            EXPECT_TRUE(result.stats.interrupted);
            EXPECT_EQ(asked, stopped) << "a callback that stops is not asked again";
            if (bands > 1) continue;  // some bands may have no samples
            EXPECT_GE(result.stats.samples, 1);
            EXPECT_GE(std::ranges::min(layer(result, "samples.Y").pixels), 1);
            for (int c = 0; c < 3; ++c)
                EXPECT_NEAR(mean_of_pixels(result.beauty, c).value / mean_of_pixels(even, c).value, 1, 0.2);
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

}  // namespace
}  // namespace halflight::test
