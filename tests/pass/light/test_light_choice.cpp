// Tests that pictures by all light selection methods converge to the oracle's picture and differ only in noise.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/pass/renders.h"
#include "tests/pass/scenes.h"
#include "tests/support/gpu_test.h"
#include "tests/support/reference_renders.h"

namespace halflight::test {
namespace {

class LightChoiceTest : public GpuTest {
  protected:
    RenderResult picture(const Scene& scene, LightChoice choice, int samples, int bounces) {
        RenderSettings settings = small_settings(scene.cameras.front(), 32, 32, samples, bounces);
        settings.estimator.lights = choice;
        return render(context, scene, settings);
    }
    /// Expects means of the oracle's picture by each choice; automatic resolves to all lights. A shift of a
    /// channel by 17 % always shows: the bound is at most 12.5 %, and the standard error 2.5 %.
    void expect_oracles(const Scene& scene, int bounces, int samples, std::initializer_list<LightChoice> choices) {
        const ReferenceResult oracle = render_oracle(scene, scene.cameras.front(), 32, 2 * samples, bounces);
        for (const LightChoice choice : choices) {
            SCOPED_TRACE(name(choice));
            const RenderResult result = picture(scene, choice, samples, bounces);
            EXPECT_EQ(result.stats.estimator.lights, choice == LightChoice::automatic ? LightChoice::all : choice);
            for (int channel = 0; channel < 3; ++channel) {
                const MeanValue found = mean_radiance(result, channel);
                const MeanRadiance expected = mean_radiance(oracle, channel);
                const double error = std::hypot(found.error, expected.error);
                EXPECT_NEAR(found.value, expected.value, 5 * error) << channel;
                EXPECT_LT(error, 0.025 * found.value) << "and reports it";
            }
        }
    }
};

/// Returns a Cornell box with a glossy block, lit by 40 small squares, point and spot lights, and a dim sky. MIS weighs
/// glossy rays that hit lights against light selection.
Scene lit_by_many() {
    Scene scene = cornell_box(metal_material(vec3(0.9f, 0.8f, 0.6f), 0.3f));
    const int light = add_material(scene, light_material(vec3(20)));
    for (int i = 0; i < 40; ++i) {
        const auto f = static_cast<float>(i);
        const vec3 at(0.8f * std::sin(3.1f * f), 0.9f * std::sin(1.7f * f + 1), 0.8f * std::sin(2.3f * f + 2));
        if (i % 2 == 0) {
            const float size = 0.03f + 0.002f * f;
            add_quad(scene, light, at, {size, 0.3f * size, 0}, {0, size, 0.5f * size});
            continue;
        }
        PunctualLight& lamp = scene.lights.emplace_back();
        lamp.type = i % 4 == 1 ? LightType::point : LightType::spot;
        lamp.position = dvec3(0.9f * at);
        lamp.direction = vec3(0, i % 8 < 4 ? 1 : -1, 0);
        lamp.intensity = vec3(0.05f);
        lamp.inner_cone = 0.3f, lamp.outer_cone = 0.8f;
    }
    scene.environment.color = vec3(0.05f);
    return scene;
}

TEST_F(LightChoiceTest, PicturesAreTheOracles) {
    expect_oracles(lit_by_many(), 4, 128,
                   {LightChoice::tree, LightChoice::power, LightChoice::uniform, LightChoice::all});
}

/// Few lights at unequal distances beside a map with a small sun. MIS weighs rays that meet the map or a square against
/// the selection between map and tree.
TEST_F(LightChoiceTest, FewLightsBesideAMapAreTheOracles) {
    Scene scene = floor_scene(metal_material(vec3(0.9f, 0.8f, 0.6f), 0.4f));
    add_quad(scene, add_material(scene, diffuse_material(vec3(0.6f))), {-0.5f, 0, -0.6f}, {1, 0, 0}, {0, 1, 0});
    add_quad(scene, add_material(scene, light_material(vec3(5))), {-1.2f, 0.4f, 0.3f}, {0.2f, 0, 0}, {0, 0.2f, 0.1f});
    scene.lights.emplace_back().position = dvec3(0.8, 0.5, 0.2);
    scene.lights.back().intensity = vec3(0.2f);
    scene.environment.map = Image(32, 16, 3);
    for (std::size_t i = 0; i < scene.environment.map.pixels.size(); ++i)
        scene.environment.map.pixels[i] = 0.05f * static_cast<float>(i * 37 % 11);
    for (int k = 0; k < 3; ++k) scene.environment.map.at(20, 4)[k] = 60;
    scene.cameras = {spot_camera(dvec3(0, 0.2, 0), {0.3, 1.5, 2.5}, 3)};
    expect_oracles(scene, 3, 128, {LightChoice::automatic, LightChoice::tree, LightChoice::power});
}

/// Nothing occludes one of several lamps of one colour, so only the share of uniform choices causes noise.
TEST_F(LightChoiceTest, SamplesOfAllLampsHaveLittleNoiseWithoutShadows) {
    Scene scene = floor_scene(diffuse_material(vec3(0.5f)));
    for (int i = 0; i < 4; ++i) {
        PunctualLight& lamp = scene.lights.emplace_back();
        lamp.position = dvec3(1.5 * i - 2, 0.5 + i, 0.3);
        lamp.intensity = 0.5f * static_cast<float>(1 + i) * vec3(1, 2, 0.5f);
    }
    scene.cameras = {spot_camera(dvec3(0), {0.1, 2, 0.2}, 6)};
    // The place of samples in a pixel is the same in both pictures.
    const RenderResult one = picture(scene, LightChoice::automatic, 1, 1);
    EXPECT_EQ(one.stats.estimator.lights, LightChoice::all);
    RenderSettings settings = small_settings(scene.cameras.front(), 32, 32, 1, 1);
    settings.estimator.shadow = ShadowRays::eight;
    const RenderResult eight = render(context, scene, settings);
    const RenderResult tree = picture(scene, LightChoice::tree, 1, 1);
    double apart = 0, apart_tree = 0, sum = 0;
    for (std::size_t i = 0; i < one.beauty.pixels.size(); ++i) {
        const double exact = eight.beauty.pixels[i];
        apart += std::pow(double(one.beauty.pixels[i]) - exact, 2);
        apart_tree += std::pow(double(tree.beauty.pixels[i]) - exact, 2);
        sum += exact * exact;
    }
    EXPECT_LT(apart, 0.002 * sum) << "relative variance of each sample";
    EXPECT_LT(apart, 0.4 * apart_tree);
}

/// Pairs of spot lights point away from each other, above a floor. If bounds let opposite cones cancel, samples would
/// go to lights that do not shine there.
TEST_F(LightChoiceTest, OppositeSpotsCostNothing) {
    Scene scene = floor_scene(diffuse_material(vec3(0.5f)));
    for (int i = 0; i < 64; ++i) {
        for (const float y : {-1.0f, 1.0f}) {
            PunctualLight& spot = scene.lights.emplace_back();
            spot.type = LightType::spot;
            spot.position = dvec3(i % 8 - 3.5, 2, i / 8 - 3.5);
            spot.direction = vec3(0, y, 0);
            spot.inner_cone = 0.4f, spot.outer_cone = 0.6f;
        }
    }
    scene.cameras = {spot_camera(dvec3(0), {0.1, 1, 0.2}, 6)};
    const auto relative_error = [&](LightChoice choice) {
        const MeanValue mean = mean_radiance(picture(scene, choice, 64, 1), 0);
        return mean.error / mean.value;
    };
    // About one of 128 spot lights reaches a place, so selection by power wastes nearly all samples.
    EXPECT_LT(relative_error(LightChoice::tree), 0.4 * relative_error(LightChoice::power));
}

}  // namespace
}  // namespace halflight::test
