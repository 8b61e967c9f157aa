// Tests paths of many bounces with a known course between two mirrors, and the lists of these paths.
#include "passes/light/continuation.h"

#include <gtest/gtest.h>

#include <cmath>

#include "engine/core/statistics.h"
#include "tests/pass/renders.h"
#include "tests/pass/scenes.h"
#include "tests/support/gpu_test.h"

namespace halflight::test {
namespace {

constexpr float kWall = 4;       // height of the mirrors
constexpr double kSlope = 0.35;  // rise of a ray per unit of horizontal distance
constexpr int kWidth = 24, kHeight = 96;

/// Mirrors at z = -1 and z = 1 that end at y = kWall, under a sky. The camera is between the mirrors and looks up at
/// the first one. The number of reflections before a ray reaches the sky differs by pixel row.
class CorridorTest : public GpuTest {
  protected:
    CorridorTest() {
        scene.environment.color = {1, 2, 4};
        const int mirror = add_material(scene, metal_material(color, 0));
        add_quad(scene, mirror, {-50, -9, -1}, {100, 0, 0}, {0, 9 + kWall, 0});
        add_quad(scene, mirror, {-50, -9, 1}, {100, 0, 0}, {0, 9 + kWall, 0});
        camera = look_at_camera({0, 2, 0}, {0, 2 + kSlope, -1}, {0, 1, 0}, 1);
        camera.orthographic = true;
        camera.ortho_height = 4.5;
    }

    /// Returns the number of reflections of the ray through a row's point, or -1 if the ray passes too close to an end
    /// of a mirror.
    int reflections(double row) const {
        const double slant = std::sqrt(1 + kSlope * kSlope);
        // The camera's plane is tilted, so a pixel's ray starts as far behind the centre in z as above it in y.
        const double up = (1 - 2 * row / kHeight) * camera.ortho_height / 2;
        double y = 2 + up / slant, z = up * kSlope / slant;
        y += kSlope * (z + 1);
        int count = 0;
        while (y < kWall) {
            if (kWall - y < 1e-3) return -1;
            y += 2 * kSlope;
            ++count;
        }
        return y - kWall < 1e-3 && count == 0 ? -1 : count;
    }
    dvec3 reflectance() const {
        const double cosine = 1 / std::sqrt(1 + kSlope * kSlope);
        return dvec3(color) + (1.0 - dvec3(color)) * std::pow(1 - cosine, 5);
    }

    const vec3 color{0.9f, 0.7f, 0.5f};
    Scene scene;
    Camera camera;
};

TEST_F(CorridorTest, EveryPathHasTheProductOfItsReflectances) {
    for (const int bounces : {0, 1, 2, 3}) {  // Russian roulette starts only at the third vertex after the first
        RenderSettings settings = small_settings(camera, kWidth, kHeight, 1, bounces);
        const RenderResult r = render(context, scene, settings);
        // The sample's position in its pixel is unknown here. Rows that may see the end of a mirror are skipped.
        int seen[5] = {0, 0, 0, 0, 0};
        for (int y = 0; y < kHeight; ++y) {
            const int n = reflections(y + 0.5);
            if (n < 0 || reflections(y) != n || reflections(y + 1) != n) continue;
            ++seen[std::min(n, 4)];
            const dvec3 sky(scene.environment.color);
            const dvec3 expected = n > bounces ? dvec3(0) : sky * glm::pow(reflectance(), dvec3(n));
            const std::string own = n == 0 ? "emission" : n == 1 ? "direct_glossy" : "indirect_glossy";
            for (const char* component :
                 {"emission", "direct_glossy", "indirect_glossy", "direct_diffuse", "indirect_diffuse"}) {
                const Image& image = layer(r, std::string(component) + ".R");
                for (int i = 0; i < 3 * kWidth; ++i) {
                    const double value = component == own ? expected[i % 3] : 0;
                    ASSERT_NEAR(image.at(0, y)[i], value, 1e-5 * value)
                        << component << ", bounces " << bounces << ", reflections " << n << ", row " << y;
                }
            }
        }
        for (const int rows : seen) EXPECT_GT(rows, 3);
    }
}

TEST_F(CorridorTest, RouletteKeepsTheMean) {
    // The count is no power of two. If all strata of the roulette were filled, pixels would hardly differ.
    const RenderSettings settings = small_settings(camera, kWidth, kHeight, 61, 12);
    const RenderResult r = render(context, scene, settings);
    int deep = 0;
    for (int y = 0; y < kHeight; ++y) {
        const int n = reflections(y + 0.5);
        if (n < 0 || reflections(y) != n || reflections(y + 1) != n) continue;
        const dvec3 expected = dvec3(scene.environment.color) * glm::pow(reflectance(), dvec3(n));
        deep += n >= 4;
        for (int c = 0; c < 3; ++c) {
            RunningMoments row;
            for (int x = 0; x < kWidth; ++x) row.add(r.beauty.at(x, y)[c]);
            EXPECT_NEAR(row.mean(), expected[c], 4.5 * row.standard_error() + 1e-5 * expected[c]) << n << ", row " << y;
            EXPECT_LT(row.standard_error(), 0.05 * expected[c]) << n << ", row " << y;
        }
    }
    EXPECT_GT(deep, 10);
}

TEST_F(CorridorTest, TwelveBouncesAreTwelve) {
    // The mirrors are practically endless, so no light arrives.
    scene.meshes[0].positions[2].y = scene.meshes[0].positions[3].y = 1e3f;
    scene.meshes[1].positions[2].y = scene.meshes[1].positions[3].y = 1e3f;
    const RenderResult r = render(context, scene, small_settings(camera, kWidth, kHeight, 2, 12));
    for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x) EXPECT_EQ(r.beauty.at(x, y)[0], 0);
    for (const BadValues& n : r.stats.bad_values) EXPECT_EQ(n.total(), 0u);
}

}  // namespace
}  // namespace halflight::test
