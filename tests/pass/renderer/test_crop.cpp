// Tests crops and overscan, whose pixels have the bits of the whole picture, and transparent backgrounds.
#include <gtest/gtest.h>

#include "engine/core/error.h"
#include "tests/pass/renders.h"
#include "tests/pass/scenes.h"
#include "tests/support/error_message.h"
#include "tests/support/gpu_test.h"

namespace halflight::test {
namespace {

class CropTest : public GpuTest {
  protected:
    /// Cuts pixels out of all pictures of a result.
    static RenderResult cut(RenderResult result, const PixelWindow& window) {
        result.beauty = part_of(result.beauty, window.first, window.size());
        result.view = part_of(result.view, window.first, window.size());
        for (ExrLayer& own : result.aovs) own.image = part_of(own.image, window.first, window.size());
        return result;
    }
    RenderResult rendered(const RenderSettings& s) { return Renderer(prepared, colors, s).render(); }

    Scene scene = curtain_scene();
    PreparedScene prepared{context, scene};
    ColorConfig colors = ColorConfig::load();
};

TEST_F(CropTest, PixelsAreThoseOfTheWholePicture) {
    for (const PrimaryVisibility primary : {PrimaryVisibility::raster, PrimaryVisibility::traced}) {
        RenderSettings s = all_settings(scene, 86, 70, 3);
        s.primary = primary;
        if (primary == PrimaryVisibility::traced) s.estimator.sampler = SamplePoints::blue_noise;
        const RenderResult whole = rendered(s);
        for (const PixelWindow& window : {PixelWindow{{17, 5}, {49, 38}}, {{40, 33}, {86, 70}}, {{85, 69}, {86, 70}}}) {
            RenderSettings part = s;
            part.crop = window;
            part.band_pixels = 48 * 16;
            expect_same(rendered(part), cut(whole, window));
        }
    }
}

TEST_F(CropTest, PixelsThatShareTheirPathsAreTheSame) {
    const Scene cornell = shiny_cornell();
    RenderSettings s = all_settings(cornell, 70, 60, 5);
    s.estimator.reuse = Reuse::sixteen;
    const auto picture = [&](const RenderSettings& settings) { return render(context, cornell, settings); };
    const RenderResult whole = picture(s);
    const PixelWindow window{{21, 30}, {68, 59}};
    s.crop = window;
    expect_same(picture(s), cut(whole, window));
}

TEST_F(CropTest, OverscanAddsPixelsAround) {
    RenderSettings s = all_settings(scene, 64, 48, 2);  // whole blocks: no pixel beyond the edge shares their paths
    s.primary = PrimaryVisibility::traced;
    const RenderResult whole = rendered(s);
    s.overscan = 9;
    const RenderResult wide = rendered(s);
    EXPECT_EQ(wide.beauty.width, 64 + 18);
    EXPECT_EQ(wide.beauty.height, 48 + 18);
    expect_same(cut(wide, {{9, 9}, {9 + 64, 9 + 48}}), whole);
    EXPECT_FALSE(same_bits(part_of(wide.beauty, {0, 0}, {9, 66}), Image(9, 66, 4))) << "the scene goes on there";
    // A crop may lie beyond the edge as well.
    s.overscan = 0;
    s.crop = PixelWindow{{-9, -9}, {3, 20}};
    expect_same(rendered(s), cut(wide, {{0, 0}, {12, 29}}));
    s.primary = PrimaryVisibility::raster;
    EXPECT_EQ(error_message([&] { rendered(s); }),
              "render settings: primary raster shows no overscan, for which every ray is traced");
}

TEST_F(CropTest, FiltersOfTheWholePictureAreRefused) {
    RenderSettings s = all_settings(scene, 64, 48, 16);
    s.crop = PixelWindow{{0, 0}, {16, 16}};
    s.adaptive = true;
    EXPECT_NE(error_message([&] { rendered(s); }).find("crop and overscan cannot be combined"), std::string::npos);
    s.crop.reset();
    EXPECT_NO_THROW(rendered(s));
}

TEST_F(CropTest, TransparentBackgroundsLeaveOutOnlyTheEnvironment) {
    Scene lit = pyramids();
    lit.environment.color = vec3(0.5f, 1, 2);
    RenderSettings s = small_settings(camera_on_pyramids(), 60, 40, 8, 3);
    s.want_view = true;
    s.estimator.camera = CameraRays::four;
    const RenderResult opaque = render(context, lit, s);
    s.transparent = true;
    const RenderResult clear = render(context, lit, s);
    int covered = 0, open = 0, edges = 0;
    for (int y = 0; y < 40; ++y)
        for (int x = 0; x < 60; ++x) {
            const float alpha = clear.beauty.at(x, y)[3];
            EXPECT_EQ(opaque.beauty.at(x, y)[3], 1);
            covered += alpha == 1, open += alpha == 0, edges += alpha > 0 && alpha < 1;
            for (int c = 0; c < 3; ++c) {
                EXPECT_LE(clear.beauty.at(x, y)[c], opaque.beauty.at(x, y)[c]);
                EXPECT_EQ(layer(clear, "direct_diffuse.R").at(x, y)[c], layer(opaque, "direct_diffuse.R").at(x, y)[c]);
                EXPECT_EQ(layer(clear, "emission.R").at(x, y)[c], 0) << "nothing else emits light";
            }
        }
    EXPECT_GT(covered, 100);
    EXPECT_GT(open, 100);
    EXPECT_GT(edges, 10);
    // The picture over the environment is the opaque one, as far as the rays of alpha see what those of light see.
    s.estimator.camera = CameraRays::one;
    s.transparent = false;
    const RenderResult plain = render(context, lit, s);
    s.transparent = true;
    const RenderResult over = render(context, lit, s);
    for (int y = 0; y < 40; ++y)
        for (int x = 0; x < 60; ++x) {
            const float* const p = over.beauty.at(x, y);
            for (int c = 0; c < 3; ++c)
                EXPECT_NEAR(p[c] + (1 - p[3]) * lit.environment.color[c], plain.beauty.at(x, y)[c], 2e-6);
        }
    // Colours of the view are not premultiplied: they are those of the mean of the covered samples.
    const Image shown = colors.view(s.view).apply(straight(over.beauty));
    for (std::size_t i = 0; i < shown.pixels.size(); ++i) EXPECT_NEAR(over.view.pixels[i], shown.pixels[i], 2e-3);
}

}  // namespace
}  // namespace halflight::test
