// Tests clamped indirect light: which samples the clamp changes, and that its bias is reported.
#include <gtest/gtest.h>

#include "engine/core/error.h"
#include "tests/pass/renders.h"
#include "tests/pass/scenes.h"
#include "tests/support/gpu_test.h"

namespace halflight::test {
namespace {

using ClampTest = GpuTest;

double luminance(const float* p) {
    return 0.2126 * p[0] + 0.7152 * p[1] + 0.0722 * p[2];
}

double mean_luminance(const Image& image) {
    double sum = 0;
    for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x) sum += luminance(image.at(x, y));
    return sum / image.width / image.height;
}

TEST_F(ClampTest, NoClampAndAHighClampChangeNothing) {
    const Scene scene = shiny_cornell();
    RenderSettings settings = all_settings(scene, 33, 29, 3);
    const RenderResult plain = render(context, scene, settings);
    EXPECT_TRUE(plain.stats.biases.empty());
    settings.clamp = 1e30f;
    expect_same(render(context, scene, settings), plain);
    settings.clamp = 0;
    settings.kept = Kept::everything();  // builds the clamping code, too
    expect_same(render(context, scene, settings), plain);
}

TEST_F(ClampTest, DimsBrightIndirectSamplesAndKeepsTheirHue) {
    const Scene scene = shiny_cornell();
    RenderSettings settings = small_settings(scene.cameras[0], 64, 48, 1, 4);
    const RenderResult plain = render(context, scene, settings);
    constexpr float kMost = 0.06f;
    settings.clamp = kMost;
    const RenderResult clamped = render(context, scene, settings);
    for (const char* untouched : {"emission.R", "direct_diffuse.R", "direct_glossy.R"})
        EXPECT_TRUE(same_bits(layer(clamped, untouched), layer(plain, untouched))) << untouched;
    int dimmed = 0, kept = 0;
    for (const char* name : {"indirect_diffuse.R", "indirect_glossy.R"}) {
        const Image &before = layer(plain, name), &after = layer(clamped, name);
        for (int y = 0; y < before.height; ++y) {
            for (int x = 0; x < before.width; ++x) {
                const float *b = before.at(x, y), *a = after.at(x, y);
                const double light = luminance(b);
                if (light <= kMost * (1 - 1e-5)) {
                    ++kept;
                    for (int c = 0; c < 3; ++c) ASSERT_EQ(a[c], b[c]);
                } else {
                    ++dimmed;
                    for (int c = 0; c < 3; ++c) ASSERT_NEAR(a[c], b[c] * kMost / light, 1e-5 * kMost);
                }
            }
        }
    }
    EXPECT_GT(dimmed, 100);
    EXPECT_GT(kept, 1000);
}

TEST_F(ClampTest, IsReportedAsABias) {
    const Scene scene = shiny_cornell();
    RenderSettings settings = small_settings(scene.cameras[0], 32, 32, 16, 4);
    const RenderResult plain = render(context, scene, settings);
    settings.clamp = 0.1f;
    const RenderResult clamped = render(context, scene, settings);
    EXPECT_LT(mean_luminance(clamped.beauty), 0.95 * mean_luminance(plain.beauty));
    ASSERT_EQ(clamped.stats.biases.size(), 1u);
    EXPECT_EQ(clamped.stats.biases[0], "indirect light clamped to a luminance of 0.1 per sample");
    EXPECT_EQ(clamped.stats.layer_biases, clamped.stats.biases);
    settings.bounces = 1;
    EXPECT_TRUE(render(context, scene, settings).stats.biases.empty()) << "there is no indirect light";
    settings.clamp = -1;
    EXPECT_THROW(render(context, scene, settings), Error);
}

}  // namespace
}  // namespace halflight::test
