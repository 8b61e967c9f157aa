// Tests --denoise through the renderer: smaller errors, an unbiased mean beside the picture, equal bits whatever the
// schedule.
#include <gtest/gtest.h>

#include "engine/core/error.h"
#include "engine/core/metrics.h"
#include "renderer/frame_constants.h"
#include "tests/pass/renders.h"
#include "tests/pass/scenes.h"
#include "tests/support/error_message.h"
#include "tests/support/gpu_test.h"

namespace halflight::test {
namespace {

class DenoisedPictureTest : public GpuTest {
  protected:
    RenderSettings settings_of(const Scene& scene, int width, int height, int samples) {
        RenderSettings s = small_settings(scene.cameras[0], width, height, samples, 3);
        s.aovs.insert(s.aovs.end(), {"noisy", "denoiser", "samples"});
        return s;
    }
    RenderResult render(PreparedScene& prepared, const RenderSettings& settings, bool denoise = true) {
        RenderSettings s = settings;
        s.denoise = denoise;
        return Renderer(prepared, colors, s).render();
    }
    ColorConfig colors = ColorConfig::load();
};

double relative_error(const Image& image, const Image& reference) {
    return mean_of(relative_squared_error_map(rgb(image), rgb(reference)));
}

TEST_F(DenoisedPictureTest, ItsErrorIsSmallerAndTheRestStays) {
    const Scene scene = shiny_cornell();
    PreparedScene prepared(context, scene);
    RenderSettings settings = settings_of(scene, 64, 48, 8);
    const RenderResult plain = render(prepared, settings, false), denoised = render(prepared, settings);
    EXPECT_FALSE(same_bits(plain.beauty, denoised.beauty));
    EXPECT_TRUE(same_bits(layer(denoised, "noisy.R"), rgb(plain.beauty)));
    EXPECT_TRUE(same_bits(layer(plain, "noisy.R"), rgb(plain.beauty)));
    for (const char* own : {"emission.R", "direct_diffuse.R", "indirect_glossy.R", "variance.R"})
        EXPECT_TRUE(same_bits(layer(plain, own), layer(denoised, own))) << own;
    EXPECT_TRUE(plain.stats.biases.empty());
    ASSERT_EQ(denoised.stats.biases.size(), 1u);
    EXPECT_TRUE(denoised.stats.biases[0].starts_with("denoised: ")) << denoised.stats.biases[0];
    EXPECT_TRUE(denoised.stats.layer_biases.empty());
    for (const float weight : layer(plain, "denoiser.glossy").pixels) ASSERT_EQ(weight, 0);
    const Image& weights = layer(denoised, "denoiser.glossy");
    EXPECT_GT(mean_of_pixels(weights, 0).value, 0.3);
    for (const float weight : weights.pixels) ASSERT_TRUE(weight >= 0 && weight <= 1) << weight;

    settings.samples = 1024, settings.seed = 5;
    const Image reference = render(prepared, settings, false).beauty;
    EXPECT_LT(relative_error(denoised.beauty, reference), 0.25 * relative_error(plain.beauty, reference));
    for (int c = 0; c < 3; ++c)
        EXPECT_NEAR(mean_of_pixels(denoised.beauty, c).value / mean_of_pixels(plain.beauty, c).value, 1, 0.02);
}

TEST_F(DenoisedPictureTest, OneSampleStaysAsItIs) {
    const Scene scene = shiny_cornell();
    PreparedScene prepared(context, scene);
    RenderSettings settings = settings_of(scene, 33, 20, 1);
    const RenderResult denoised = render(prepared, settings);
    EXPECT_TRUE(same_bits(denoised.beauty, render(prepared, settings, false).beauty));
    EXPECT_TRUE(denoised.stats.biases.empty());
    settings.width = settings.height = 1;
    for (const int samples : {1, 2, 3}) {
        settings.samples = samples;
        const Image picture = render(prepared, settings).beauty;
        for (const float value : picture.pixels) EXPECT_TRUE(std::isfinite(value) && value >= 0);
    }
    settings.bounces = 0;
    EXPECT_TRUE(render(prepared, settings).stats.biases.empty()) << "emission is not filtered";
}

TEST_F(DenoisedPictureTest, IsEqualInBandsAndInTurns) {
    const Scene scene = shiny_cornell();
    PreparedScene prepared(context, scene);
    RenderSettings settings = settings_of(scene, 45, 60, 6);
    settings.want_view = true;
    const RenderResult whole = render(prepared, settings);
    EXPECT_TRUE(same_bits(whole.view, colors.view({}).apply(whole.beauty))) << "the view is another picture's";
    settings.band_pixels = 48 * 16;
    expect_same(render(prepared, settings), whole);
    settings.in_turns = true, settings.denoise = true;
    Renderer in_turns(prepared, colors, settings);
    std::vector<RenderResult> seen;
    expect_same(in_turns.render([&](const RenderProgress& progress) {
        if (progress.picture && progress.samples_done == 3) seen.push_back(progress.picture(settings.aovs));
        return true;
    }),
                whole);
    ASSERT_FALSE(seen.empty());
    settings.samples = 3;
    expect_same(seen.back(), render(prepared, settings));
}

TEST_F(DenoisedPictureTest, ErrorTargetsReferToTheMean) {
    const Scene scene = shiny_cornell();
    PreparedScene prepared(context, scene);
    RenderSettings settings = settings_of(scene, 32, 24, 64);
    settings.error = ErrorTarget{.error = 1e-6};
    const RenderResult plain = render(prepared, settings, false), denoised = render(prepared, settings);
    ASSERT_TRUE(plain.stats.error && denoised.stats.error);
    EXPECT_EQ(plain.stats.error->estimate.value, denoised.stats.error->estimate.value);
    EXPECT_EQ(plain.stats.error->estimate.bound, denoised.stats.error->estimate.bound);
    EXPECT_TRUE(same_bits(layer(denoised, "noisy.R"), rgb(plain.beauty)));
    EXPECT_FALSE(same_bits(denoised.beauty, plain.beauty));
}

TEST_F(DenoisedPictureTest, PreviewModesAreRefused) {
    const Scene scene = shiny_cornell();
    PreparedScene prepared(context, scene);
    RenderSettings settings = settings_of(scene, 16, 16, 2);
    settings.preview.filter = true;
    EXPECT_EQ(error_message([&] { render(prepared, settings); }),
              "render settings: denoising cannot be combined with a preview mode");
}

TEST(Halves, AreEqualAtPowersOfTwo) {
    int first = 0;
    for (std::uint32_t n = 0; n < 1024; ++n) {
        const bool power = n > 1 && (n & (n - 1)) == 0;
        EXPECT_TRUE(!power || 2 * first == static_cast<int>(n)) << n;
        first += in_first_half(n) ? 1 : 0;
        const int all = static_cast<int>(n) + 1;
        EXPECT_TRUE(all < 2 || (3 * first >= all && 3 * first <= 2 * all + 1)) << n;
    }
}

}  // namespace
}  // namespace halflight::test
