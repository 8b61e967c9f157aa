// Tests that a picture does not depend on the bands in which it is rendered, bit for bit.
#include <gtest/gtest.h>

#include "engine/io/gltf/gltf.h"
#include "passes/surface/raster_window.h"
#include "tests/pass/renders.h"
#include "tests/pass/scenes.h"
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
    const Scene scene = load_gltf(std::string(HALFLIGHT_SOURCE_DIR) + "/scenes/atrium.glb");
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
    settings.culling = rays::Culling::raster;
    expect_the_same(scene, settings);
    settings.estimator.shadow = ShadowRays::four;
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

}  // namespace
}  // namespace halflight::test
