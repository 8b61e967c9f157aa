// Tests that pixels do not depend on the bands, the crop or the overscan with which they are rendered, bit for bit.
// Tests transparent backgrounds.
#include <gtest/gtest.h>

#include <filesystem>

#include "engine/core/error.h"
#include "engine/io/gltf/gltf.h"
#include "passes/surface/raster_window.h"
#include "tests/pass/renders.h"
#include "tests/pass/scenes.h"
#include "tests/support/error_message.h"
#include "tests/support/gpu_test.h"

namespace halflight::test {
namespace {

class BandsTest : public GpuTest {
  protected:
    RenderResult in_bands(const Scene& scene, RenderSettings settings, int rows) {
        settings.band_pixels = static_cast<std::size_t>((settings.width + 15) / 16 * 16 * rows);
        return render(context, scene, settings);
    }

    /// Compares pictures in bands of 16 rows, in bands of 48 rows, and in one band.
    void expect_the_same(const Scene& scene, const RenderSettings& settings) {
        const RenderResult whole = in_bands(scene, settings, settings.height + 15);
        for (const int rows : {16, 48}) {
            SCOPED_TRACE(testing::Message() << "bands of " << rows << " rows");
            expect_same(in_bands(scene, settings, rows), whole);
        }
    }
};

// Walls, ledges and bases are coplanar and abut without common vertices, so rounding decides which one is hit.
TEST_F(BandsTest, Atrium) {
    const Scene scene = load_gltf(std::filesystem::path(HALFLIGHT_SOURCE_DIR) / "scenes/atrium.glb");
    RenderSettings settings = all_settings(scene, 150, 110, 2);
    settings.bounces = 2;
    for (const PrimaryVisibility primary : {PrimaryVisibility::raster, PrimaryVisibility::traced}) {
        SCOPED_TRACE(name(primary));
        settings.primary = primary;
        settings.estimator.reuse = primary == PrimaryVisibility::traced ? Reuse::eight : Reuse::off;
        expect_the_same(scene, settings);
    }
}

TEST_F(BandsTest, InstancesBehindVeils) {
    Scene scene = pyramids();
    const Camera camera = camera_on_pyramids();
    Material veil = diffuse_material(vec3(0.7f));
    veil.alpha_mode = AlphaMode::blend;
    veil.base_color.a = 0.4f;
    // One veil is in front of the whole scene, another across the path of the light.
    const dvec3 eye(camera.camera_to_world[3]), ahead(-camera.camera_to_world[2]);
    const vec3 right(camera.camera_to_world[0]), up(camera.camera_to_world[1]);
    const int material = add_material(scene, veil);
    for (const double distance : {1.0, 1.1, 1.2})
        add_quad(scene, material, vec3(eye + distance * ahead) - right - up, 2.0f * right, 2.0f * up);
    scene.environment.color = vec3(1);
    RenderSettings settings = small_settings(camera, 70, 90, 3, 3);
    expect_the_same(scene, settings);
    scene.environment.light_group = 0;
    scene.light_groups = {"sky", "rest"};
    settings.aovs.insert(settings.aovs.end(), {"light_sky", "light_rest"});
    settings.culling = rays::Culling::raster;
    settings.estimator.shadow = ShadowRays::four;
    settings.estimator.reuse = Reuse::sixteen;
    expect_the_same(scene, settings);
}

TEST(RasterWindow, DependsOnTheRowAlone) {
    for (const ivec2& image : {ivec2(3, 40000), ivec2(16384, 16384), ivec2(9000, 5000), ivec2(1280, 720)}) {
        const int stride = window_stride(image);
        ASSERT_TRUE(stride == image.y || (stride >= 16 && (stride & (stride - 1)) == 0)) << stride;
        const int texture_rows = raster_window({image, 0, 16}).rows;
        EXPECT_LE(texture_rows, 16384);
        for (const int rows : {16, 64, stride}) {
            for (int y = 0; y < image.y; y += rows) {
                const RasterWindow window = raster_window({image, y, rows});
                const RasterWindow of_row = raster_window({image, y + std::min(rows, image.y - y) - 1, 1});
                ASSERT_EQ(window.y, of_row.y) << y;
                ASSERT_EQ(window.rows, texture_rows);
                ASSERT_LE(window.y, std::max(y - 1, 0));
                ASSERT_GE(window.y + window.rows, std::min(y + rows + 1, image.y));
            }
        }
    }
}

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
    EXPECT_NE(error_message([&] { rendered(s); }).find("overscan"), std::string::npos);
}

TEST_F(CropTest, FiltersOfTheWholePictureAreRefused) {
    RenderSettings s = all_settings(scene, 64, 48, 16);
    s.crop = PixelWindow{{0, 0}, {16, 16}};
    s.denoise = true, s.denoise_frames = 1;
    EXPECT_NE(error_message([&] { rendered(s); }).find("crop"), std::string::npos);
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
