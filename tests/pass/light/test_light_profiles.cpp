// Tests lamps with profiles against the candela tables of their files, and the choice among such lamps.
#include <gtest/gtest.h>

#include <cmath>

#include "engine/io/ies.h"
#include "engine/tables/lights.h"
#include "tests/pass/renders.h"
#include "tests/pass/scenes.h"
#include "tests/support/gpu_test.h"
#include "tests/support/ies_files.h"
#include "tests/support/reference_renders.h"

namespace halflight::test {
namespace {

constexpr float kAlbedo = 0.5f;
constexpr double kDistance = 2;  // metres

/// Returns a lamp at the origin, turned as a node by 90 degrees about X and then about an axis.
PunctualLight turned_lamp(float candela) {
    PunctualLight lamp;
    lamp.profile = 0;
    lamp.intensity = vec3(candela, 0.5f * candela, 0);
    lamp.direction = glm::normalize(vec3(0.3f, -0.9f, 0.2f));
    set_profile_axes(lamp, dmat3(dvec3(0.8, 0.2, -0.3), dvec3(0.1, -0.2, -1), -dvec3(lamp.direction)));
    return lamp;
}

/// Returns the direction of two angles, degrees.
dvec3 direction_of(const PunctualLight& lamp, double v, double h) {
    const double a = glm::radians(v), b = glm::radians(h);
    return std::cos(a) * dvec3(lamp.direction) +
           std::sin(a) * (std::cos(b) * dvec3(lamp.right) + std::sin(b) * dvec3(lamp.up));
}

class LightProfiles : public GpuTest {
  protected:
    /// Expects a patch that faces the lamp to receive the intensity of the table over the square of the distance.
    void expect_table(const IesFile& file, float radius) {
        const LightProfile profile = read_ies("test.ies", file.text());
        const double factor = file.multiplier * file.ballast * (file.first_line == "IESNA91" ? file.lamp : 1);
        Scene scene;
        scene.light_profiles = {profile};
        scene.lights = {turned_lamp(profile.candela)};
        scene.lights[0].radius = radius;
        const int white = add_material(scene, diffuse_material(vec3(kAlbedo)));
        struct Patch {
            Camera camera;
            double candela, v, h;
        };
        std::vector<Patch> patches;
        const auto add = [&](double v, double h, double candela) {
            const dvec3 out = direction_of(scene.lights[0], v, h), at = kDistance * out;
            const dvec3 u = glm::normalize(glm::cross(out, std::abs(out.x) < 0.5 ? dvec3(1, 0, 0) : dvec3(0, 1, 0)));
            const dvec3 w = glm::cross(out, u);
            add_quad(scene, white, vec3(at - 0.005 * (u + w)), vec3(0.01 * u), vec3(0.01 * w));
            patches.push_back({look_at_camera(at - 0.5 * out, at, u, 0.01), candela, v, h});
        };
        for (std::size_t i = 0; i + 1 < file.vertical.size(); i += 2)
            for (std::size_t j = 0; j < file.horizontal.size(); j += 3) {
                const double v = file.vertical[i], h = file.horizontal[j];
                const auto of = [&](std::size_t row, std::size_t column) {
                    return factor * file.candela(file.vertical[row], file.horizontal[column]);
                };
                if (v > 0) add(v, h, of(i, j));
                if (v > 0 && file.horizontal.back() == 180) add(v, 360 - h, of(i, j));
                if (file.vertical[i + 1] >= 175 || j + 1 == file.horizontal.size()) continue;
                const double between = (of(i, j) + of(i + 1, j) + of(i, j + 1) + of(i + 1, j + 1)) / 4;
                add((v + file.vertical[i + 1]) / 2, (h + file.horizontal[j + 1]) / 2, between);
            }
        scene.cameras = {patches[0].camera};
        RenderSettings settings = small_settings(patches[0].camera, 4, 4, radius > 0 ? 64 : 1, 1);
        PreparedScene prepared(context, scene, {.estimator = settings.estimator});
        Renderer renderer(prepared, ColorConfig::load(), settings);
        for (const Patch& patch : patches) {
            settings.camera = patch.camera;
            const RenderResult result = renderer.render(settings);
            for (int channel = 0; channel < 2; ++channel) {
                const double expected = (channel == 0 ? 1 : 0.5) * patch.candela / (kDistance * kDistance);
                const double found = mean_radiance(result, channel).value * kPi / double{kAlbedo};
                EXPECT_NEAR(found, expected, 0.02 * expected + 1e-4 * double{profile.candela})
                    << file.first_line << ' ' << patch.v << ' ' << patch.h;
            }
        }
        RecordProperty("patches", static_cast<int>(patches.size()));
    }
};

TEST_F(LightProfiles, ADownlightHasItsTable) {
    expect_table(downlight(), 0);
}

TEST_F(LightProfiles, AStreetLampHasItsTable) {
    expect_table(street_lamp(), 0);
}

TEST_F(LightProfiles, AWasherHasItsTable) {
    expect_table(washer(), 0);
}

TEST_F(LightProfiles, ASmallBallHasTheTable) {
    expect_table(downlight(), 0.02f);
}

/// Lamps that shine past each other, dark ones among them, so that a choice by the greatest intensity alone misleads.
Scene box_with_lamps() {
    Scene scene = cornell_box(metal_material(vec3(0.9f, 0.8f, 0.6f), 0.3f));
    for (Material& material : scene.materials) material.emission = vec3(0);
    IesFile dark = downlight();
    dark.candela = [](double, double) { return 0.0; };
    for (const IesFile& file : {downlight(), street_lamp(), washer(), dark})
        scene.light_profiles.push_back(read_ies("test.ies", file.text()));
    for (int i = 0; i < 24; ++i) {
        const double f = i;
        PunctualLight& lamp = scene.lights.emplace_back();
        lamp.position = {0.8 * std::sin(3.1 * f), 0.8 * std::sin(1.7 * f + 1), 0.8 * std::sin(2.3 * f + 2)};
        lamp.profile = i % 5 == 4 ? kNone : i % 4;
        lamp.intensity = vec3(lamp.profile == kNone ? 0.05f : 0.2f);
        lamp.direction = i % 2 == 0 ? vec3(0, -1, 0) : vec3(0, 1, 0);
        set_profile_axes(lamp, dmat3(1));
        if (i % 3 == 0) lamp.radius = 0.05f;
    }
    return scene;
}

TEST_F(LightProfiles, EveryChoiceHasTheOraclesMean) {
    const Scene scene = box_with_lamps();
    const ReferenceResult oracle = render_oracle(scene, scene.cameras.front(), 32, 256, 3);
    for (const LightChoice choice : {LightChoice::power, LightChoice::tree, LightChoice::all}) {
        RenderSettings settings = small_settings(scene.cameras.front(), 32, 32, 128, 3);
        settings.estimator.lights = choice;
        const RenderResult result = render(context, scene, settings);
        const MeanValue found = mean_radiance(result, 0);
        const MeanRadiance expected = mean_radiance(oracle, 0);
        const double error = std::hypot(found.error, expected.error);
        EXPECT_NEAR(found.value, expected.value, 5 * error) << name(choice);
        // A choice by power knows no places, so it seldom finds the lamp in whose narrow beam a point is.
        EXPECT_LT(error, (choice == LightChoice::power ? 0.2 : 0.025) * found.value) << name(choice);
        for (const BadValues& n : result.stats.bad_values) EXPECT_EQ(n.total(), 0u) << n.component;
    }
}

TEST_F(LightProfiles, AreChosenByTheirMeans) {
    Scene scene = box_with_lamps();
    scene.lights.resize(2);
    for (int i = 0; i < 2; ++i) {
        scene.lights[std::size_t(i)].profile = 2 * i;
        scene.lights[std::size_t(i)].intensity = vec3(1);
        scene.lights[std::size_t(i)].radius = 0;  // lights with a size have places of their own
    }
    const TraceTables trace = build_trace_tables(scene);
    const LightTables tables = build_lights(scene, trace, LightChoice::power);
    const double first = mean_share(scene.light_profiles[0]), other = mean_share(scene.light_profiles[2]);
    // lights.h: shares by power, and an eighth in equal parts
    EXPECT_NEAR(tables.probabilities[0], 0.875 * first / (first + other) + 0.0625, 1e-6);
    EXPECT_TRUE(tables.needs.light_profiles);
    scene.lights[0].profile = 3;  // dark
    EXPECT_EQ(build_lights(scene, trace, LightChoice::power).probabilities.size(), 1u);
    scene.lights.resize(1);
    EXPECT_TRUE(build_lights(scene, trace).rows.empty());
}

}  // namespace
}  // namespace halflight::test
