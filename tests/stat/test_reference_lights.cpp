// Tests direct light of every kind in the oracle against closed forms.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "engine/core/statistics.h"
#include "engine/io/ies.h"
#include "engine/reference/environment.h"
#include "engine/reference/random.h"
#include "tests/support/ies_files.h"
#include "tests/support/image_tests.h"
#include "tests/support/reference_renders.h"
#include "tests/support/scenes.h"

namespace halflight {
namespace {

using namespace test;

constexpr float kAlbedo = 0.6f;

/// Returns a large diffuse floor at y = 0, facing up.
Scene floor_scene() {
    Scene scene;
    add_quad(scene, add_material(scene, diffuse_material(vec3(kAlbedo))), {-50, 0, -50}, {0, 0, 100}, {100, 0, 0});
    return scene;
}

/// Returns a camera that sees a tiny area around the floor's origin from the side.
Camera at_origin() {
    return look_at_camera({3, 2, 1}, {0, 0, 0}, {0, 1, 0}, 1e-5);
}

/// Expects a radiance within four standard errors; the standard error must be below a thousandth.
void expect_radiance(const ReferenceResult& result, double expected, int channel = 0) {
    const MeanRadiance mean = mean_radiance(result, channel);
    EXPECT_NEAR(mean.value, expected, 4 * mean.error + 1e-5 * expected);
    EXPECT_LE(mean.error, 1e-3 * expected);
    EXPECT_EQ(result.non_finite_samples, 0u);
}

TEST(ReferenceLights, SquareLightHasItsFormFactor) {
    Scene scene = floor_scene();
    const int light = add_material(scene, light_material({5, 2, 1}));
    add_quad(scene, light, {-0.7f, 1.5f, -0.7f}, {1.4f, 0, 0}, {0, 0, 1.4f});
    // The expected value is four times the configuration factor to a parallel rectangle with a corner above the point
    // (Howell, Menguc, Radiation configuration factors, B-3).
    const double x = 0.7 / 1.5, root = std::sqrt(1 + x * x);
    const double form_factor = 4 * 2 * x / root * std::atan(x / root) / (2 * kPi);
    expect_radiance(render_oracle(scene, at_origin(), 16, 1024, 1), kAlbedo * 5 * form_factor);

    // Twelve instances of a small quad, some of them mirrored, form the same light.
    Scene instanced = floor_scene();
    add_quad(instanced, add_material(instanced, light_material({5, 2, 1})), {0, 0, 0}, {1, 0, 0}, {0, 0, 1});
    const Instance part = instanced.instances.back();
    instanced.instances.pop_back();
    for (int i = 0; i < 12; ++i) {
        Instance placed = part;
        const double w = 1.4 / 4, d = 1.4 / 3, flip = i % 2 ? -1 : 1;
        placed.object_to_world = dmat4(dvec4(flip * w, 0, 0, 0), dvec4(0, 1, 0, 0), dvec4(0, 0, d, 0),
                                       dvec4(-0.7 + (i % 4 + (flip < 0)) * w, 1.5, -0.7 + (i / 4) * d, 1));
        instanced.instances.push_back(placed);
    }
    expect_radiance(render_oracle(instanced, at_origin(), 16, 1024, 1), kAlbedo * 5 * form_factor);
}

TEST(ReferenceLights, PointSpotAndDirectionalAreExact) {
    PunctualLight light;
    light.intensity = {10, 20, 30};
    light.position = {1, 2, -1};
    light.direction = normalize(vec3(-1, -2, 1));
    const double distance2 = 6, cosine = 2 / std::sqrt(6.0);
    Scene scene = floor_scene();
    scene.lights = {light};
    expect_radiance(render_oracle(scene, at_origin(), 4, 4, 1), kAlbedo / kPi * 30 * cosine / distance2, 2);

    scene.lights[0].type = LightType::spot;
    scene.lights[0].direction = vec3(0, -1, 0);  // the origin is off the spot light's axis
    scene.lights[0].inner_cone = 0.3f;
    scene.lights[0].outer_cone = 0.9f;
    const double fade = (cosine - std::cos(0.9f)) / (std::cos(0.3f) - std::cos(0.9f));
    expect_radiance(render_oracle(scene, at_origin(), 4, 4, 1), kAlbedo / kPi * 20 * cosine / distance2 * fade * fade,
                    1);
    scene.lights[0].outer_cone = 0.5f;  // the point is outside this cone
    EXPECT_EQ(mean_radiance(render_oracle(scene, at_origin(), 4, 4, 1)).value, 0);

    scene.lights[0].type = LightType::directional;
    scene.lights[0].direction = normalize(vec3(-1, -2, 1));
    expect_radiance(render_oracle(scene, at_origin(), 4, 4, 1), kAlbedo / kPi * 10 * cosine);
    EXPECT_EQ(mean_radiance(render_oracle(scene, at_origin(), 4, 4, 0)).value, 0);  // 0 bounces render emission only
}

TEST(ReferenceLights, ProfilesHaveTheirTables) {
    for (const IesFile& file : {downlight(), street_lamp(), washer()}) {
        Scene scene = floor_scene();
        scene.light_profiles = {read_ies("test.ies", file.text())};
        PunctualLight& light = scene.lights.emplace_back();
        light.profile = 0;
        light.intensity = vec3(scene.light_profiles[0].candela);
        // The floor's origin lies at the second vertical and the third horizontal angle of the table, if it has one.
        const double v = glm::radians(file.vertical[1]);
        const double angle = file.horizontal.size() > 2 ? file.horizontal[2] : 0, h = glm::radians(angle);
        light.position = {0.5, 2, 0};
        const dvec3 down = glm::normalize(-light.position), side = glm::normalize(glm::cross(down, dvec3(0, 0, 1)));
        light.direction = vec3(std::cos(v) * down - std::sin(v) * side);
        const dvec3 across = std::cos(v) * side + std::sin(v) * down;  // where the origin lies from the direction
        const dvec3 third = glm::cross(-dvec3(light.direction), across);
        light.right = vec3(std::cos(h) * across - std::sin(h) * third);
        light.up = vec3(std::sin(h) * across + std::cos(h) * third);
        const double factor = file.multiplier * file.ballast * (file.first_line == "IESNA91" ? file.lamp : 1);
        const double candela = factor * file.candela(file.vertical[1], angle);
        expect_radiance(render_oracle(scene, at_origin(), 4, 4, 1), kAlbedo / kPi * candela * -down.y / 4.25);
        scene.lights[0].radius = 0.01f;
        const MeanRadiance ball = mean_radiance(render_oracle(scene, at_origin(), 16, 64, 1));
        EXPECT_NEAR(ball.value, kAlbedo / kPi * candela * -down.y / 4.25, 0.02 * ball.value) << file.first_line;
    }
}

TEST(ReferenceLights, ShadowsOfPunctualLightsAreHard) {
    Scene scene = floor_scene();
    scene.lights.resize(1);
    scene.lights[0].intensity = vec3(10);
    scene.lights[0].position = {0, 2, 0};
    add_quad(scene, 0, {-0.1f, 1, -0.1f}, {0.2f, 0, 0}, {0, 0, 0.2f});
    const ReferenceResult result =
        render_oracle(scene, look_at_camera({0, 0.9, 0}, {0, 0, 0}, {0, 0, 1}, 0.9), 16, 8, 1);
    EXPECT_EQ(*result.beauty.at(8, 8), 0);    // the pixel is in the shadow, |x| < 0.2
    EXPECT_GT(*result.beauty.at(0, 8), 0.1);  // the pixel is outside the shadow
}

TEST(ReferenceLights, EmissionTextureIsSampledAsItIsHit) {
    // Half of the light is black. The other half alone must give the same result.
    Scene scene = floor_scene();
    Material glow = light_material(vec3(4));
    glow.emission_texture.image = 0;
    glow.emission_texture.nearest = true;
    scene.images.push_back({"half", 2, 1, {255, 255, 255, 255, 0, 0, 0, 255}});
    add_quad(scene, add_material(scene, glow), {-1, 1, -1}, {2, 0, 0}, {0, 0, 2});
    Scene half = floor_scene();
    add_quad(half, add_material(half, light_material(vec3(4))), {-1, 1, -1}, {1, 0, 0}, {0, 0, 2});
    const Camera camera = look_at_camera({0, 0.9, 0}, {0, 0, 0}, {0, 0, 1}, 1.2);
    const ReferenceResult a = render_oracle(scene, camera, 16, 256, 1, 1),
                          b = render_oracle(half, camera, 16, 256, 1, 2);
    EXPECT_TRUE(agree("reference-emission-texture", {a.beauty, a.variance, 256}, {b.beauty, b.variance, 256}));
}

TEST(ReferenceLights, BlendedLightsAndBlockersCountByAlpha) {
    Scene scene = floor_scene();
    add_quad(scene, add_material(scene, light_material(vec3(5))), {-0.7f, 1.5f, -0.7f}, {1.4f, 0, 0}, {0, 0, 1.4f});
    const double full = mean_radiance(render_oracle(scene, at_origin(), 16, 1024, 1)).value;

    scene.materials.back().alpha_mode = AlphaMode::blend;
    scene.materials.back().base_color.a = 0.25f;
    const MeanRadiance thin = mean_radiance(render_oracle(scene, at_origin(), 16, 1536, 1));
    EXPECT_NEAR(thin.value, 0.25 * full, 4 * thin.error + 0.003 * full);

    scene.materials.back().alpha_mode = AlphaMode::opaque;
    Material veil = diffuse_material(vec3(0));
    veil.alpha_mode = AlphaMode::blend;
    veil.base_color.a = 0.5f;
    add_quad(scene, add_material(scene, veil), {-3, 1, -3}, {6, 0, 0}, {0, 0, 6});
    const Camera below = look_at_camera({0.5, 0.5, 0}, {0, 0, 0}, {0, 1, 0}, 1e-5);
    const MeanRadiance veiled = mean_radiance(render_oracle(scene, below, 16, 1536, 1));
    EXPECT_NEAR(veiled.value, 0.5 * full, 4 * veiled.error + 0.003 * full);
}

/// Returns a map with values in [0.1, 1.1] that differ in every direction, except for one very bright texel.
Environment test_environment() {
    Environment environment;
    environment.color = {1, 0.5f, 2};
    environment.map = Image(24, 12, 3);
    reference::Random random(9);
    for (float& value : environment.map.pixels) value = static_cast<float>(0.1 + random.uniform());
    for (int c = 0; c < 3; ++c) environment.map.at(5, 3)[c] = 200;
    return environment;
}

double integrate_sphere(const std::function<double(const dvec3&)>& f) {
    constexpr int kRows = 600, kColumns = 1200;
    double sum = 0;
    for (int j = 0; j < kRows; ++j) {
        const double y = 1 - 2 * (j + 0.5) / kRows, s = std::sqrt(1 - y * y);
        for (int i = 0; i < kColumns; ++i) {
            const double phi = 2 * kPi * (i + 0.5) / kColumns;
            sum += f({s * std::cos(phi), y, s * std::sin(phi)});
        }
    }
    return sum * 4 * kPi / (kRows * kColumns);
}

TEST(ReferenceLights, EnvironmentDensityIsItsSamplesDensity) {
    const Environment environment = test_environment();
    const reference::EnvironmentLight light(environment);
    EXPECT_NEAR(integrate_sphere([&](const dvec3& d) { return light.pdf(d); }), 1, 2e-3);
    EXPECT_NEAR(integrate_sphere([&](const dvec3& d) { return light.radiance(d).y; }) /
                    integrate_sphere([&](const dvec3& d) { return light.radiance(d).z; }),
                0.25, 0.1);

    // Importance sampling estimates the integral of the radiance and of any function of direction.
    reference::Random random(3);
    RunningMoments radiance, x;
    for (int i = 0; i < 200000; ++i) {
        const double u1 = random.uniform(), u2 = random.uniform();
        const dvec3 d = light.sample(u1, u2);
        ASSERT_NEAR(length(d), 1, 1e-12);
        radiance.add(light.radiance(d).x / light.pdf(d));
        x.add(light.radiance(d).x * d.x / light.pdf(d));
    }
    const double exact = integrate_sphere([&](const dvec3& d) { return light.radiance(d).x; });
    const double exact_x = integrate_sphere([&](const dvec3& d) { return light.radiance(d).x * d.x; });
    EXPECT_NEAR(radiance.mean(), exact, 4 * radiance.standard_error() + 1e-4 * exact);
    EXPECT_NEAR(x.mean(), exact_x, 4 * x.standard_error() + 1e-4 * exact);
    EXPECT_LT(std::sqrt(radiance.variance()), 0.8 * exact);
}

TEST(ReferenceLights, EnvironmentOrientationIsAsDocumented) {
    Scene scene;
    scene.environment = test_environment();
    for (const auto& [x, y] : {std::pair{5, 3}, std::pair{0, 11}, std::pair{17, 6}}) {
        const double phi = 2 * kPi * ((x + 0.5) / 24 - 0.5), theta = kPi * (y + 0.5) / 12;
        const dvec3 d(std::sin(theta) * std::cos(phi), std::cos(theta), std::sin(theta) * std::sin(phi));
        const Camera camera = look_at_camera(dvec3(7), dvec3(7) + d, {0, 0.3, 1}, 1e-6);
        const ReferenceResult result = render_oracle(scene, camera, 2, 1, 3);
        EXPECT_NEAR(result.beauty.at(0, 0)[2], 2 * scene.environment.map.at(x, y)[2], 1e-3);
        EXPECT_EQ(*result.alpha.at(0, 0), 0);
    }
}

TEST(ReferenceLights, FloorUnderEnvironmentReceivesTheUpperHalf) {
    Scene scene = floor_scene();
    scene.environment = test_environment();
    const reference::EnvironmentLight light(scene.environment);
    const double irradiance = integrate_sphere([&](const dvec3& d) { return d.y > 0 ? light.radiance(d).x * d.y : 0; });
    const MeanRadiance mean = mean_radiance(render_oracle(scene, at_origin(), 16, 1024, 1));
    EXPECT_NEAR(mean.value, kAlbedo / kPi * irradiance, 4 * mean.error + 1e-3 * mean.value);
}

TEST(ReferenceLights, AllStrategiesAgree) {
    // A glossy and a coated diffuse plate lie under an area light, a blended light and a map, with two bounces.
    Scene scene = floor_scene();
    scene.environment = test_environment();
    Material coated = diffuse_material({0.7f, 0.4f, 0.2f});
    coated.clearcoat = 1;
    coated.clearcoat_roughness = 0.3f;
    coated.transmission = 0.4f;
    coated.roughness = 0.5f;
    coated.specular = 1;
    Material veil = light_material(vec3(3));
    veil.alpha_mode = AlphaMode::blend;
    veil.base_color.a = 0.4f;
    scene.materials[0] = metal_material(vec3(0.9f), 0.5f);
    add_quad(scene, add_material(scene, coated), {-1, 0.2f, -1}, {0, 0.4f, 2}, {2, 0, 0});
    add_quad(scene, add_material(scene, light_material(vec3(6))), {-1, 1.5f, -1}, {0.8f, 0, 0}, {0, 0, 0.8f});
    add_quad(scene, add_material(scene, veil), {0.5f, 0.7f, -1.2f}, {0.6f, 0, 0}, {0, 0.6f, 0});

    ReferenceSettings settings;
    settings.width = settings.height = 24;
    settings.bounces = 2;
    settings.samples = 512;
    settings.camera = look_at_camera({2, 1.2, 2.5}, {0, 0.4, 0}, {0, 1, 0}, 0.7);
    const ReferenceScene prepared(scene);
    const ReferenceResult mis = render_reference(prepared, settings);
    for (const auto strategy : {ReferenceStrategy::lights_only, ReferenceStrategy::surfaces_only}) {
        ReferenceSettings other = settings;
        other.strategy = strategy;
        other.seed = 17;
        const ReferenceResult alone = render_reference(prepared, other);
        EXPECT_TRUE(
            agree(strategy == ReferenceStrategy::lights_only ? "reference-lights-only" : "reference-surfaces-only",
                  {alone.beauty, alone.variance, 512}, {mis.beauty, mis.variance, 512},
                  {.block = 4, .relative_difference = 0}));
        EXPECT_GT(mean_radiance(alone).error, mean_radiance(mis).error);  // MIS must reduce the noise
    }
}

}  // namespace
}  // namespace halflight
