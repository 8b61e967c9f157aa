// Tests lamps that the camera sees (--show-lamps): radiance and size of their discs in closed form, alpha, and pictures
// of scenes without them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "engine/core/statistics.h"
#include "tests/pass/renders.h"
#include "tests/pass/scenes.h"
#include "tests/support/gpu_test.h"

namespace halflight::test {
namespace {

constexpr int kSide = 32;      // pixels of a side of the picture
constexpr double kView = 1;    // angle of the view, radians
constexpr float kLight = 3;    // cd, or lx of a sun
constexpr float kSize = 0.4f;  // radius of a lamp, 2 m before the camera
constexpr double kAway = 2;

/// Returns a lamp before a camera that looks to -Z, a floor behind the camera, and `type` as the lamp's.
Scene lamp_scene(LightType type = LightType::point) {
    Scene scene;
    add_quad(scene, add_material(scene, diffuse_material(vec3(0.5f))), {-1, -1, 5}, {2, 0, 0}, {0, 2, 0});
    PunctualLight& lamp = scene.lights.emplace_back();
    lamp.type = type;
    lamp.position = {0, 0, -kAway};
    lamp.direction = {0, 0, 1};
    lamp.intensity = kLight * vec3(1, 0.5f, 0.25f);
    lamp.inner_cone = 0.7f;
    lamp.radius = kSize;
    lamp.angle = 2 * std::asin(float(kSize / kAway));
    scene.cameras = {look_at_camera({0, 0, 0}, {0, 0, -1}, {0, 1, 0}, kView)};
    return scene;
}

RenderSettings lamp_settings(const Scene& scene, int samples = 64) {
    RenderSettings s = small_settings(scene.cameras[0], kSide, kSide, samples, 2);
    s.show_lamps = s.transparent = true;
    return s;
}

/// Returns the radiance of the disc of lamp_scene().
double radiance_of(LightType type) {
    const double size = type == LightType::directional ? double(kSize) / kAway : double(kSize);
    return kLight / (kPi * size * size);
}

/// Returns the share of the picture that a cone about its axis covers. A plane cuts a circle out of the cone.
double share_of_cone(double sine) {
    const double radius = std::tan(std::asin(sine)), side = 2 * std::tan(kView / 2);
    return kPi * radius * radius / (side * side);
}

class ShownLamps : public GpuTest {
  protected:
    RenderResult rendered(const Scene& scene, const RenderSettings& settings) {
        RenderResult result = render(context, scene, settings);
        for (const BadValues& n : result.stats.bad_values) EXPECT_EQ(n.total(), 0u) << n.component;
        return result;
    }
    static std::string why_left_out(const RenderResult& result) {
        const auto& all = result.stats.left_out;
        const auto found = std::ranges::find(all, "lamps seen by the camera", &LeftOut::what);
        return found == all.end() ? "" : found->fact;
    }
};

TEST_F(ShownLamps, AreDiscsOfTheirRadianceAndSolidAngle) {
    constexpr std::pair<PrimaryVisibility, CameraRays> kMethods[] = {{PrimaryVisibility::raster, CameraRays::one},
                                                                     {PrimaryVisibility::raster, CameraRays::four},
                                                                     {PrimaryVisibility::traced, CameraRays::one}};
    for (const LightType type : {LightType::point, LightType::spot, LightType::directional})
        for (const auto& [primary, rays] : kMethods) {
            SCOPED_TRACE(testing::Message() << int(type) << name(primary) << int(rays));
            const Scene scene = lamp_scene(type);
            RenderSettings settings = lamp_settings(scene, 16);
            settings.primary = primary;
            settings.estimator.camera = rays;
            const RenderResult result = rendered(scene, settings);
            const double radiance = radiance_of(type), share = share_of_cone(double(kSize) / kAway);
            double light = 0;
            for (int y = 0; y < kSide; ++y)
                for (int x = 0; x < kSide; ++x) {
                    const float* const p = result.beauty.at(x, y);
                    light += double(p[0]) / (kSide * kSide);
                    EXPECT_LT(p[0], (1 + 1e-5) * radiance) << "a disc of one radiance";
                    EXPECT_EQ(p[3], 0) << "lamps hide nothing";
                }
            EXPECT_NEAR(light, radiance * share, 0.02 * radiance * share);
            EXPECT_NEAR(result.beauty.at(kSide / 2, kSide / 2)[0], radiance, 1e-5 * radiance);
            EXPECT_NEAR(result.beauty.at(kSide / 2, kSide / 2)[2], radiance / 4, 1e-5 * radiance);
            EXPECT_EQ(result.beauty.at(0, 0)[0], 0);
            EXPECT_EQ(layer(result, "emission.R").at(kSide / 2, kSide / 2)[0],
                      result.beauty.at(kSide / 2, kSide / 2)[0]);
            EXPECT_EQ(why_left_out(result), "");
        }
}

TEST_F(ShownLamps, HaveTheirSolidAngleInPanoramas) {
    Scene scene = lamp_scene();
    scene.cameras[0].optics.projection = Projection::panorama;
    RenderSettings settings = lamp_settings(scene);
    settings.camera = scene.cameras[0];
    settings.width = 2 * kSide;
    const RenderResult result = rendered(scene, settings);
    const Image& seen = layer(result, "emission.R");
    double angle = 0;
    for (int y = 0; y < seen.height; ++y)
        for (int x = 0; x < seen.width; ++x)
            angle += double(seen.at(x, y)[0]) * std::sin(kPi * (y + 0.5) / seen.height);
    angle *= 2 * kPi / seen.width * kPi / seen.height / radiance_of(LightType::point);
    const double cosine = std::sqrt(1 - std::pow(double(kSize) / kAway, 2)), expected = 2 * kPi * (1 - cosine);
    EXPECT_NEAR(angle, expected, 0.01 * expected);
}

TEST_F(ShownLamps, KeepTheirLightOutOfFocus) {
    const Scene scene = lamp_scene();
    RenderSettings settings = lamp_settings(scene);
    settings.camera.lens = {.aperture = 300, .focus = {.kind = Focus::Kind::distance, .distance = 1}};
    const RenderResult result = rendered(scene, settings);
    const double expected = radiance_of(LightType::point) * share_of_cone(double(kSize) / kAway);
    EXPECT_NEAR(mean_of_pixels(result.beauty, 0).value, expected, 0.03 * expected);
    const float* const edge = result.beauty.at(kSide / 2 + 6, kSide / 2);
    const double most = radiance_of(LightType::point);
    EXPECT_TRUE(edge[0] > 0.05 * most && edge[0] < 0.95 * most) << edge[0];
}

TEST_F(ShownLamps, ShineAsTheyAreAimedAndHideNothing) {
    Scene scene = lamp_scene(LightType::spot);
    scene.lights[0].direction = {0, 0, -1};  // seen from behind
    RenderSettings settings = lamp_settings(scene, 4);
    for (const float value : rendered(scene, settings).beauty.pixels) ASSERT_EQ(value, 0);
    // A wall behind a lamp shines through it, and one through its middle cuts it.
    scene.lights[0].direction = {0, 0, 1};
    scene.environment.color = vec3(0.5f);
    settings.transparent = false;
    const double radiance = radiance_of(LightType::spot);
    EXPECT_NEAR(rendered(scene, settings).beauty.at(kSide / 2, kSide / 2)[0], radiance + 0.5, 1e-4);
    Material glow = light_material(vec3(2));
    add_quad(scene, add_material(scene, glow), {0, -5, -3}, {5, 0, 0}, {0, 10, 0});
    add_quad(scene, 1, {-5, -5, -1}, {5, 0, 0}, {0, 10, 0});
    const Image cut = rendered(scene, settings).beauty;
    EXPECT_NEAR(cut.at(kSide / 2 + 3, kSide / 2)[0], radiance + 2, 1e-4);
    EXPECT_NEAR(cut.at(kSide / 2 - 3, kSide / 2)[0], 2, 1e-4);
    // The camera is inside of the lamp.
    Scene around = lamp_scene();
    around.lights[0].radius = 100;
    for (const float value : rgb(rendered(around, lamp_settings(around, 2)).beauty).pixels) ASSERT_GT(value, 0);
    // The lamp lies before the near plane, and behind the far one.
    Scene clipped = lamp_scene();
    for (const auto& [near_plane, far_plane] : {std::pair(4.0, 10.0), std::pair(0.1, 1.0)}) {
        clipped.cameras[0].near_plane = near_plane, clipped.cameras[0].far_plane = far_plane;
        for (const float value : rendered(clipped, lamp_settings(clipped, 2)).beauty.pixels) ASSERT_EQ(value, 0);
    }
}

TEST_F(ShownLamps, LeaveTheAlphaOfShadowCatchers) {
    Scene scene = lamp_scene();
    add_quad(scene, 0, {-9, -9, -4}, {18, 0, 0}, {0, 18, 0});
    scene.instances.back().catcher = true;
    add_quad(scene, 0, {-0.5f, -9, -3}, {1, 0, 0}, {0, 18, 0});  // throws a shadow behind the lamp
    RenderSettings settings = lamp_settings(scene, 16);
    const Image beauty = rendered(scene, settings).beauty;
    settings.show_lamps = false;
    const Image without = rendered(scene, settings).beauty;
    for (std::size_t i = 3; i < beauty.pixels.size(); i += 4) ASSERT_EQ(beauty.pixels[i], without.pixels[i]);
    EXPECT_GT(beauty.at(kSide / 2, kSide / 2)[0], without.at(kSide / 2, kSide / 2)[0] + 1);
}

TEST_F(ShownLamps, ChangeNoBitOfScenesWithoutThem) {
    Scene scene = cornell_box();
    PunctualLight& lamp = scene.lights.emplace_back();
    lamp.position = {0.2, 0.3, 0.4};
    RenderSettings settings = all_settings(scene, 32, 32, 2);
    const RenderResult without = rendered(scene, settings);
    EXPECT_EQ(why_left_out(without), "lamps are not shown (--show-lamps)");
    settings.show_lamps = true;
    const RenderResult shown = rendered(scene, settings);
    EXPECT_EQ(why_left_out(shown), "no lamp has a size");
    expect_same(shown, without);
}

TEST_F(ShownLamps, AreNotFilteredAndHaveTheSameBitsInEachPart) {
    // The denoiser filters what surfaces reflect, so lamps add what they add to the mean, but for its weights, and for
    // the noise that it leaves where it is hardly seen beside them.
    Scene scene = cornell_box();
    for (int i = 0; i < 6; ++i) {
        PunctualLight& lamp = scene.lights.emplace_back();
        lamp.position = {0.3 * i - 0.75, 0.1 * i, 0.4};
        lamp.intensity = vec3(0.02f, 0.01f, 0.03f);
        lamp.radius = 0.05f;
    }
    RenderSettings settings = small_settings(scene.cameras[0], 48, 48, 16, 3);
    settings.denoise = true;
    settings.estimator = {.reuse = Reuse::four, .camera = CameraRays::one, .shadow = ShadowRays::one};
    const RenderResult hidden = rendered(scene, settings);
    settings.show_lamps = true;
    const RenderResult shown = rendered(scene, settings);
    double most = 0;
    for (int y = 0; y < 48; ++y)
        for (int x = 0; x < 48; ++x)
            for (int c = 0; c < 3; ++c) {
                const double added = layer(shown, "emission.R").at(x, y)[c] - layer(hidden, "emission.R").at(x, y)[c];
                most = std::max(most, added);
                EXPECT_NEAR(shown.beauty.at(x, y)[c] - hidden.beauty.at(x, y)[c], added,
                            2e-2 * (1 + shown.beauty.at(x, y)[c]));
            }
    EXPECT_GT(most, 1);
    settings.denoise = false;
    const RenderResult whole = rendered(scene, settings);
    settings.band_pixels = 1;
    expect_same(rendered(scene, settings), whole);
    settings.crop = PixelWindow{{10, 20}, {40, 44}};
    const Image part = rendered(scene, settings).beauty;
    for (int y = 20; y < 44; ++y)
        for (int x = 10; x < 40; ++x)
            for (int c = 0; c < 4; ++c)
                ASSERT_EQ(part.at(x - 10, y - 20)[c], whole.beauty.at(x, y)[c]) << x << " " << y;
}

}  // namespace
}  // namespace halflight::test
