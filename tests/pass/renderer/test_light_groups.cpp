// Tests light groups: their layers add up to the picture, which they leave as it is, and each has the light of its
// lights alone.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "engine/core/error.h"
#include "tests/pass/rays/batches.h"
#include "tests/pass/renders.h"
#include "tests/pass/scenes.h"
#include "tests/support/error_message.h"
#include "tests/support/gpu_test.h"

namespace halflight::test {
namespace {

const std::vector<std::string> kGroups = {"key", "sky", "glow", "rest"};

/// Returns a room corner with a varnished floor, a sheet of metal and lights of all kinds. key: the sun; sky:
/// environment; glow: a material and a lamp; rest: another lamp, an emissive panel and an unlit one.
Scene corner() {
    Scene scene;
    Material floor = diffuse_material({0.7f, 0.6f, 0.5f});
    floor.clearcoat = 0.8f, floor.clearcoat_roughness = 0.2f;
    add_quad(scene, add_material(scene, floor), {-2, 0, -2}, {0, 0, 4}, {4, 0, 0});
    add_quad(scene, add_material(scene, diffuse_material({0.5f, 0.7f, 0.6f})), {-2, 0, -1}, {4, 0, 0}, {0, 2, 0});
    add_box(scene, 1, {0.4f, 0, -0.2f}, {0.7f, 0.4f, 0.1f});
    add_quad(scene, add_material(scene, metal_material(vec3(0.9f), 0.1f)), {-0.4f, 0.01f, 0.1f}, {0, 0.2f, 0.7f},
             {0.9f, 0, 0});
    Material glow = diffuse_material(vec3(0.2f));
    glow.emission = {3, 1, 0.5f};
    glow.light_group = 2;
    add_box(scene, add_material(scene, glow), {-0.7f, 0.2f, -0.2f}, {-0.5f, 0.6f, 0});
    add_quad(scene, add_material(scene, light_material({0, 2, 4})), {-0.3f, 1.2f, -0.9f}, {0.6f, 0, 0}, {0, 0.3f, 0});
    Material sign = diffuse_material({0.4f, 0.1f, 0.3f});
    sign.unlit = true;
    add_quad(scene, add_material(scene, sign), {0.9f, 0, -0.5f}, {0.4f, 0, 0}, {0, 0.4f, 0});
    scene.environment.color = {0.3f, 0.4f, 0.6f};
    scene.environment.light_group = 1;
    PunctualLight sun;
    sun.type = LightType::directional;
    sun.intensity = {4, 3.6f, 3};
    sun.direction = glm::normalize(vec3(0.4f, -1, -0.3f));
    sun.light_group = 0;
    PunctualLight lamp = sun;
    lamp.type = LightType::point;
    lamp.position = {0, 0.9, 0.5};
    lamp.intensity = vec3(0.5f);
    PunctualLight other = lamp;
    lamp.radius = 0.1f, lamp.light_group = 2, sun.angle = 0.1f;  // rays meet them, before the sky and others
    other.position = {-1, 0.5, 0.5};
    other.intensity = {0.1f, 0.4f, 0.1f};
    other.light_group = kNoLightGroup;
    scene.lights = {lamp, sun, other};
    scene.light_groups = kGroups;
    scene.cameras = {look_at_camera({0.3, 0.9, 2.2}, {0, 0.4, 0}, {0, 1, 0}, 0.8)};
    return scene;
}

/// Returns the scene without the lights of other groups.
Scene only(Scene scene, std::uint32_t group) {
    const auto in_group = [&](std::uint32_t own) { return std::min(own, 3u) == group; };
    for (PunctualLight& light : scene.lights)
        if (!in_group(light.light_group)) light.intensity = vec3(0);
    for (Material& m : scene.materials) {
        if (in_group(m.light_group)) continue;
        m.emission = vec3(0);
        if (m.unlit) m.base_color = vec4(0, 0, 0, 1);
    }
    if (!in_group(scene.environment.light_group)) scene.environment.color = vec3(0);
    scene.light_groups.clear();
    return scene;
}

void add_layers(RenderSettings& settings) {
    for (const std::string& group : kGroups) settings.aovs.push_back("light_" + group);
}

RenderSettings corner_settings(int samples, int bounces = 5) {
    RenderSettings settings = small_settings(corner().cameras.front(), 32, 32, samples, bounces);
    add_layers(settings);
    return settings;
}

/// Expects that the layers add up to an image in every value.
void expect_sum(const RenderResult& result, const Image& whole, double tolerance = 2e-6) {
    double greatest = 0, light = 0;
    for (std::size_t i = 0; i < whole.pixels.size() / 3; ++i)
        for (std::size_t c = 0; c < 3; ++c) {
            double sum = 0;
            for (const std::string& group : kGroups)
                sum += double{layer(result, "light_" + group + ".R").pixels[3 * i + c]};
            const double expected = double{whole.pixels[3 * i + c]};
            greatest = std::max(greatest, std::abs(sum - expected) / std::max(expected, 1e-6));
            light += expected;
        }
    EXPECT_LT(greatest, tolerance);
    EXPECT_GT(light, 0);
}

class LightGroups : public GpuTest {
  protected:
    RenderResult rendered(const Scene& shown, const RenderSettings& settings) {
        PreparedScene prepared(context, shown, {.estimator = settings.estimator});
        return Renderer(prepared, ColorConfig::load(), settings).render();
    }
    const Scene scene = corner();
};

TEST_F(LightGroups, AddUpToThePictureAndLeaveItAsItIs) {
    const std::pair<const char*, Estimator> kEstimators[] = {
        {"all lights", {}},
        {"power, path reuse",
         {.lights = LightChoice::power, .sun = SunChoice::among, .reuse = Reuse::eight, .shadow = ShadowRays::two}},
        {"tree, path reuse, sun apart",
         {.lights = LightChoice::tree, .sun = SunChoice::apart, .reuse = Reuse::sixteen, .camera = CameraRays::four}}};
    for (const auto& [what, estimator] : kEstimators) {
        SCOPED_TRACE(what);
        RenderSettings settings = corner_settings(3);
        settings.estimator = estimator;
        settings.show_lamps = estimator.lights != LightChoice::automatic;
        settings.primary =
            estimator.lights == LightChoice::power ? PrimaryVisibility::traced : PrimaryVisibility::raster;
        const RenderResult result = rendered(scene, settings);
        expect_sum(result, rgb(result.beauty));
        RenderSettings without = settings;
        for (const std::string& group : kGroups) std::erase(without.aovs, "light_" + group);
        const RenderResult plain = rendered(scene, without);
        expect_includes(result, plain);
        const auto left = [](const RenderResult& r) {
            return std::ranges::count(r.stats.left_out, "light groups", &LeftOut::what);
        };
        EXPECT_EQ(left(plain), 1);
        EXPECT_EQ(left(result), 0);
        for (const BadValues& n : result.stats.bad_values) EXPECT_EQ(n.total(), 0u) << n.component;
    }
}

TEST_F(LightGroups, AddUpWithFewBouncesAndAClamp) {
    for (const int bounces : {1, 2}) {
        SCOPED_TRACE(bounces);
        RenderSettings settings = corner_settings(2, bounces);
        settings.clamp = 0.2f;
        settings.estimator.reuse = Reuse::four;
        const RenderResult result = rendered(scene, settings);
        expect_sum(result, rgb(result.beauty));
    }
}

TEST_F(LightGroups, HaveTheLightOfTheirLightsAlone) {
    constexpr int kSeeds = 8;
    RenderSettings settings = corner_settings(8);
    settings.estimator = {.sun = SunChoice::apart, .reuse = Reuse::four};
    PreparedScene whole(context, scene, {.estimator = settings.estimator});
    Renderer renderer(whole, ColorConfig::load(), settings);
    std::vector<Batches> layers(kGroups.size());
    for (std::uint32_t seed = 0; seed < kSeeds; ++seed) {
        settings.seed = seed;
        const RenderResult result = renderer.render(settings);
        for (std::size_t g = 0; g < kGroups.size(); ++g)
            layers[g].add(block_means(layer(result, "light_" + kGroups[g] + ".R"), 16));
    }
    for (std::uint32_t g = 0; g < kGroups.size(); ++g) {
        RenderSettings alone = corner_settings(8);
        alone.aovs.clear();
        alone.estimator = {.sun = SunChoice::among};
        PreparedScene own(context, only(scene, g), {.estimator = alone.estimator});
        Renderer of_group(own, ColorConfig::load(), alone);
        Batches pictures;
        for (std::uint32_t seed = 0; seed < kSeeds; ++seed) {
            alone.seed = 1000 + seed;
            pictures.add(block_means(rgb(of_group.render(alone).beauty), 16));
        }
        EXPECT_TRUE(agree("light-group-" + kGroups[g], layers[g].estimate(), pictures.estimate(),
                          {.p_value = 1e-5, .relative_difference = 0.01}));
    }
}

// Paths that end by roulette, from the third reflection on, leave their last light sample to the sums.
TEST_F(LightGroups, ALoneGroupHasAllLight) {
    Scene lamps = only(scene, 0);
    lamps.light_groups = kGroups;
    for (PunctualLight& light : lamps.lights) light.light_group = 2;  // neither the first group nor the rest
    const RenderResult result = rendered(lamps, corner_settings(2, 4));
    const Image beauty = rgb(result.beauty), &glow = layer(result, "light_glow.R");
    ASSERT_GT(std::ranges::max(beauty.pixels), 0);
    for (std::size_t i = 0; i < beauty.pixels.size(); ++i)
        ASSERT_NEAR(glow.pixels[i], beauty.pixels[i], 2e-6f * (1 + beauty.pixels[i])) << i;
}

TEST_F(LightGroups, OfInstancesAndMaterialsTakeTheFirst) {
    Scene two = cornell_box();
    two.materials[two.meshes.back().triangle_material[0]].light_group = kNoLightGroup;
    two.light_groups = {"first", "second", "rest"};
    RenderSettings settings = small_settings(two.cameras.front(), 24, 24, 2, 3);
    settings.aovs.insert(settings.aovs.end(), {"light_first", "light_second", "light_rest"});
    const auto has_light = [&](const char* group) {
        return std::ranges::any_of(layer(render(context, two, settings), std::string("light_") + group + ".R").pixels,
                                   [](float v) { return v > 0; });
    };
    EXPECT_TRUE(has_light("rest"));
    for (Material& m : two.materials)
        if (m.emission != vec3(0)) m.light_group = 1;
    EXPECT_FALSE(has_light("rest"));
    EXPECT_TRUE(has_light("second"));
    for (Instance& i : two.instances) i.light_group = 0;
    EXPECT_FALSE(has_light("second"));
    EXPECT_TRUE(has_light("first"));
}

TEST_F(LightGroups, AddUpWithAdaptiveSamplesAndDenoising) {
    RenderSettings settings = corner_settings(32);
    settings.adaptive = true;
    settings.denoise = true;
    settings.aovs.emplace_back("noisy");
    const RenderResult result = rendered(scene, settings);
    expect_sum(result, layer(result, "noisy.R"));
    EXPECT_TRUE(result.stats.denoised);
    settings.denoise = false;
    std::erase(settings.aovs, "noisy");
    settings.samples = 256;
    settings.error = ErrorTarget{ErrorMetric::relmse, 1};
    const RenderResult to_error = rendered(scene, settings);
    expect_sum(to_error, rgb(to_error.beauty));
}

TEST_F(LightGroups, AreRefusedWhereTheyCannotBeMade) {
    RenderSettings settings = corner_settings(1);
    settings.preview.cache = true;
    EXPECT_NE(error_message([&] { rendered(scene, settings); }).find("cache"), std::string::npos);
    settings.preview.cache = false;
    settings.aovs.pop_back();
    EXPECT_NE(error_message([&] { rendered(scene, settings); }).find("light_rest"), std::string::npos);
}

}  // namespace
}  // namespace halflight::test
