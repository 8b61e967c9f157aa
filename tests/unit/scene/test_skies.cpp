// Tests generated environments: units, colours and finite values.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "engine/scene/skies.h"

namespace halflight {
namespace {

/// Returns the irradiance of a horizontal surface by the map and the sun, by brute force.
dvec3 irradiance(const Sky& sky) {
    dvec3 sum(0);
    const Image& map = sky.environment.map;
    for (int y = 0; y < map.height / 2; ++y)
        for (int x = 0; x < map.width; ++x) {
            const double theta = kPi * (y + 0.5) / map.height;
            const double weight = std::cos(theta) * std::sin(theta) * (kPi / map.height) * (2 * kPi / map.width);
            for (int c = 0; c < 3; ++c) sum[c] += weight * double(map.at(x, y)[c]) * double(sky.environment.color[c]);
        }
    if (sky.sun) sum += -double(sky.sun->direction.y) * dvec3(sky.sun->intensity);
    return sum;
}

double luminance_of(const dvec3& c) {
    return double(luminance(vec3(c)));
}

Scene scene_of(const Sky& sky) {
    Scene scene;
    scene.environment = sky.environment;
    if (sky.sun) scene.lights.push_back(*sky.sun);
    return scene;
}

TEST(Skies, PresetsGiveAFloorARadianceOfOne) {
    for (const SkyPreset preset : sky_presets()) {
        const Sky sky = preset_sky(preset);
        EXPECT_NO_THROW(validate(scene_of(sky))) << name(preset);
        EXPECT_NEAR(luminance_of(irradiance(sky)), kPi, 0.02 * kPi) << name(preset);
        EXPECT_EQ(sky.environment.name, name(preset));
    }
    EXPECT_EQ(preset_sky(SkyPreset::overcast).environment.map.pixels, default_sky().map.pixels);
}

TEST(Skies, ClearSkyHasTheLuminanceOfThePaper) {
    // Zenith luminance with the sun at 45 degrees and turbidity 2.5 by the equation of the appendix, in nits.
    const double chi = (4.0 / 9 - 2.5 / 120) * (kPi - kPi / 2);
    const double zenith = 1000 * ((4.0453 * 2.5 - 4.9710) * std::tan(chi) - 0.2155 * 2.5 + 2.4192);
    const Sky sky = clear_sky({.elevation = 45, .azimuth = 0, .turbidity = 2.5});
    const Image& map = sky.environment.map;
    EXPECT_NEAR(luminance_of(dvec3(map.at(0, 0)[0], map.at(0, 0)[1], map.at(0, 0)[2])), zenith, 0.01 * zenith);
    EXPECT_GT(map.at(0, 0)[2], 1.3f * map.at(0, 0)[0]) << "blue";
    // Clear skies of that height measure about 70 000 lux by the sun alone. The model's sky is brighter than the
    // 10 000 to 20 000 lux of measurements.
    const double by_sun = luminance_of(dvec3(sky.sun->intensity)) * std::sqrt(0.5);
    EXPECT_GT(by_sun, 50000);
    EXPECT_LT(by_sun, 90000);
    const double by_sky = luminance_of(irradiance(sky)) - by_sun;
    EXPECT_GT(by_sky, 5000);
    EXPECT_LT(by_sky, 30000);
}

TEST(Skies, LowSunsAreRedAndDim) {
    float dimmer = 1e9f, redness = 0;
    for (const double elevation : {90.0, 45.0, 20.0, 5.0, 0.0}) {
        const Sky sky = clear_sky({.elevation = elevation});
        EXPECT_LT(sky.sun->intensity.g, dimmer);
        EXPECT_GT(sky.sun->intensity.r / sky.sun->intensity.b, redness);
        dimmer = sky.sun->intensity.g;
        redness = sky.sun->intensity.r / sky.sun->intensity.b;
    }
}

TEST(Skies, FiniteInTheWholeRange) {
    for (const double elevation : {0.0, 1e-3, 3.0, 45.0, 90.0})
        for (const double turbidity : {kLeastTurbidity, 4.0, kMostTurbidity})
            for (const double azimuth : {-360.0, 0.0, 123.4, 360.0}) {
                const Sky sky = clear_sky({elevation, azimuth, turbidity});
                EXPECT_NO_THROW(validate(scene_of(sky))) << elevation << ' ' << turbidity;
                EXPECT_GT(luminance_of(irradiance(sky)), 0) << elevation << ' ' << turbidity;
                EXPECT_LT(std::ranges::max(sky.environment.map.pixels), 2e5f) << elevation << ' ' << turbidity;
            }
}

}  // namespace
}  // namespace halflight
