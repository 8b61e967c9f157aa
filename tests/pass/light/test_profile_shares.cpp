// Tests the shares of light profiles that shaders find against bilinear interpolation of the files' tables.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "engine/io/ies.h"
#include "tests/pass/light/shading_kernel.h"
#include "tests/support/gpu_test.h"
#include "tests/support/ies_files.h"

namespace halflight::test {
namespace {

/// Returns the candela of a file before its factors, by its definition. Angles are in degrees.
double candela_of(const IesFile& file, double v, double h) {
    const auto place = [](const std::vector<double>& angles, double at) {
        const auto above = std::ranges::upper_bound(angles, at) - angles.begin();
        return std::clamp<std::size_t>(std::size_t(above), 1, angles.size() - 1) - 1;
    };
    if (v > file.vertical.back() || v < file.vertical.front()) return 0;
    if (file.horizontal.back() == 180) h = std::min(h, 360 - h);
    const std::size_t i = place(file.vertical, v), j = file.horizontal.size() > 1 ? place(file.horizontal, h) : 0;
    const double a = (v - file.vertical[i]) / (file.vertical[i + 1] - file.vertical[i]);
    const auto column = [&](double angle) {
        return (1 - a) * file.candela(file.vertical[i], angle) + a * file.candela(file.vertical[i + 1], angle);
    };
    if (file.horizontal.size() == 1) return column(0);
    const double b = (h - file.horizontal[j]) / (file.horizontal[j + 1] - file.horizontal[j]);
    return (1 - b) * column(file.horizontal[j]) + b * column(file.horizontal[j + 1]);
}

Scene one_triangle(const vec3& emission) {
    Scene scene;
    scene.materials.resize(1);
    scene.materials[0].emission = emission;
    Mesh& mesh = scene.meshes.emplace_back();
    mesh.positions = {{5, 0, 0}, {6, 0, 0}, {5, 1, 0}};
    mesh.normals.assign(3, vec3(0, 0, 1));
    mesh.triangles = {{0, 1, 2}};
    mesh.triangle_material = {0};
    scene.instances.emplace_back().mesh = 0;
    return scene;
}

class ProfileShares : public GpuTest {};

TEST_F(ProfileShares, AreBilinearInBothAngles) {
    for (const IesFile& file : {downlight(), street_lamp(), washer()}) {
        Scene scene = one_triangle(vec3(1));  // a light of another kind comes before
        scene.light_profiles = {read_ies("other.ies", downlight().text()), read_ies("test.ies", file.text())};
        PunctualLight lamp;
        lamp.direction = glm::normalize(vec3(0.2f, -1, 0.4f));
        set_profile_axes(lamp, dmat3(dvec3(0.3, 0.2, 1), dvec3(-1, -0.1, 0.2), -dvec3(lamp.direction)));
        for (const int profile : {0, kNone, 1}) {
            scene.lights.push_back(lamp);
            scene.lights.back().profile = profile;
        }
        validate(scene);
        const ShadingScene shading(scene);
        std::vector<vec4> directions;
        std::vector<double> expected;
        const double factor = file.multiplier * file.ballast * (file.first_line == "IESNA91" ? file.lamp : 1);
        for (int i = 0; i < 4096; ++i) {
            const bool pole = i < 2;  // along the axis and against it
            const double v = pole ? 180 * i : std::acos(1 - 2 * (i + 0.5) / 4096) * 180 / kPi;
            const double h = std::fmod(i * 137.50776405, 360);
            const double a = glm::radians(v), b = glm::radians(h);
            directions.emplace_back(
                vec3(std::cos(a) * dvec3(lamp.direction) +
                     std::sin(a) * (std::cos(b) * dvec3(lamp.right) + std::sin(b) * dvec3(lamp.up))),
                0);
            expected.push_back(factor * candela_of(file, v, h) / double{scene.light_profiles[1].candela});
        }
        const auto found = shading.run("#include \"shaders/lib/lights.glsl\"\n", R"(
            result[0] = vec4(profile_share(3 * kLightStride, inputs[i].xyz), profile_share(2 * kLightStride, inputs[i].xyz),
                             float(light_count()), 0.0);
        )",
                                       4096, 1, directions);
        double worst = 0;
        for (std::size_t i = 0; i < found.size(); ++i) {
            const double share = found[i].x;
            // The tables have no single value at the poles, and some end at 90 degrees.
            const bool clear = i > 1 && std::abs(glm::dot(vec3(directions[i]), lamp.direction)) > 2e-4f;
            if (clear) worst = std::max(worst, std::abs(share - expected[i]));
            EXPECT_TRUE(share >= 0 && share <= 1) << i << ": " << share;
            EXPECT_EQ(found[i].y, 1) << "a lamp without a profile";
            EXPECT_EQ(found[i].z, 4);
        }
        EXPECT_LT(worst, 2e-3) << file.first_line;
    }
}

TEST_F(ProfileShares, MakeTheIrradianceOfSamples) {
    constexpr double kDistance = 2;  // metres
    Scene scene = one_triangle(vec3(0));
    double total = 0;
    for (const IesFile& file : {downlight(), street_lamp(), washer()}) {
        PunctualLight& lamp = scene.lights.emplace_back();
        lamp.profile = static_cast<int>(scene.light_profiles.size());
        scene.light_profiles.push_back(read_ies("test.ies", file.text()));
        lamp.intensity = vec3(scene.light_profiles.back().candela);
        lamp.radius = lamp.profile == 2 ? 0.02f : 0;
        total += double{lamp.intensity.r};
    }
    std::vector<vec4> points;
    std::vector<double> expected;
    for (int i = 0; i < 96; ++i) {
        const double v = std::acos(1 - 2 * (i + 0.5) / 96) * 180 / kPi, h = std::fmod(i * 137.50776405, 360);
        const double a = glm::radians(v), b = glm::radians(h);
        points.emplace_back(vec3(kDistance * dvec3(std::sin(a) * std::cos(b), std::sin(a) * std::sin(b), -std::cos(a))),
                            0);
        double sum = 0;
        for (const IesFile& file : {downlight(), street_lamp(), washer()})
            sum += file.multiplier * file.ballast * (file.first_line == "IESNA91" ? file.lamp : 1) *
                   candela_of(file, v, h);
        expected.push_back(sum / (kDistance * kDistance));
    }
    for (const LightChoice choice : {LightChoice::power, LightChoice::tree, LightChoice::uniform}) {
        const ShadingScene shading(scene, choice);
        std::vector<vec4> inputs = points;
        for (vec4& p : inputs) p -= vec4(vec3(shading.trace.origin), 0);
        const auto found = shading.run("#include \"shaders/lib/lights.glsl\"\n", R"(
            float sum = 0.0;
            const uint kTurns = 2048u;  // llvmpipe ends loops of 65535 steps, those of the search included
            for (uint n = 0u; n < kTurns; ++n) {
                Sampler s = make_sampler(i, 3u, n, 11u);
                sum += sample_light(receiver_at(inputs[i].xyz, vec3(0.0)), sample_2d_bits(s, 1u)).weight.x;
            }
            result[0] = vec4(sum / float(kTurns));
        )",
                                       96, 1, inputs);
        for (std::size_t i = 0; i < found.size(); ++i)
            EXPECT_NEAR(double{found[i].x}, expected[i], 0.02 * expected[i] + 1e-4 * total) << name(choice) << ' ' << i;
    }
}

}  // namespace
}  // namespace halflight::test
