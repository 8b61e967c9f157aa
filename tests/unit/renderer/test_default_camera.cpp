// Tests the camera of scenes that have none, turntables, and generated environments: units, colours, finite values.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "api/first_picture/default_camera.h"
#include "api/halflight/camera.h"
#include "engine/core/chromaticities.h"
#include "engine/scene/atmosphere.h"
#include "engine/scene/skies.h"
#include "tests/support/scenes.h"

namespace halflight {
namespace {

using namespace test;

/// Returns the largest |x| and |y| of the bounds' corners in the picture, where 1 is its edge.
dvec2 extent(const Scene& scene, const Camera& camera, double aspect) {
    const WorldBounds box = world_bounds(scene);
    const dmat4 to_camera = glm::inverse(camera.camera_to_world);
    const double half = std::tan(camera.vertical_fov / 2);
    dvec2 most(0);
    for (int corner = 0; corner < 8; ++corner) {
        const dvec3 p(corner & 1 ? box.upper.x : box.lower.x, corner & 2 ? box.upper.y : box.lower.y,
                      corner & 4 ? box.upper.z : box.lower.z);
        const dvec3 q(to_camera * dvec4(p, 1));
        EXPECT_LT(q.z, 0);
        most = glm::max(most, glm::abs(dvec2(q) / -q.z / half) / dvec2(aspect, 1));
    }
    return most;
}

Scene block(const vec3& size) {
    Scene scene;
    add_box(scene, add_material(scene, diffuse_material(vec3(0.5f))), -0.5f * size, 0.5f * size);
    return scene;
}

/// Returns a closed room of 4 x 3 x 5 m whose faces point inwards, with three blocks on its floor.
Scene room() {
    Scene scene;
    const int grey = add_material(scene, diffuse_material(vec3(0.5f)));
    add_box(scene, grey, {-2, 0, -2.5f}, {2, 3, 2.5f});
    for (uvec3& triangle : scene.meshes[0].triangles) std::swap(triangle.x, triangle.y);
    for (vec3& normal : scene.meshes[0].normals) normal = -normal;
    for (const float x : {-1.0f, 0.0f, 1.0f}) add_box(scene, grey, {x - 0.2f, 0, -0.2f}, {x + 0.2f, 0.8f, 0.2f});
    return scene;
}

DefaultCamera default_camera(const Scene& scene, double aspect, View view = View::automatic) {
    return halflight::default_camera(rays::SceneProbe(scene), aspect, view);
}

TEST(DefaultCamera, FitsTheAspectOfThePicture) {
    for (const vec3& size : {vec3(1), vec3(4, 1, 1), vec3(1, 5, 1), vec3(3, 0.1f, 3)})
        for (const double aspect : {0.5, 1.0, 16.0 / 9, 3.0}) {
            const Scene scene = block(size);
            const DefaultCamera made = default_camera(scene, aspect);
            EXPECT_FALSE(made.inside);
            const dvec2 seen = extent(scene, made.camera, aspect);
            EXPECT_NEAR(std::max(seen.x, seen.y), 0.9, 1e-6) << "aspect " << aspect;
        }
}

TEST(DefaultCamera, StandsInsideClosedRooms) {
    const Scene scene = room();
    const DefaultCamera made = default_camera(scene, 16.0 / 9);
    ASSERT_TRUE(made.inside);
    const dvec3 at(made.camera.camera_to_world[3]);
    const WorldBounds box = world_bounds(scene);
    EXPECT_TRUE(glm::all(glm::greaterThan(at, box.lower)) && glm::all(glm::lessThan(at, box.upper)));
    EXPECT_EQ(made.camera.camera_to_world, default_camera(scene, 16.0 / 9).camera.camera_to_world);
    EXPECT_NE(choose_camera(scene, {}).origin.find("inside"), std::string::npos);
    // The camera sees a block: some of them lie ahead.
    const dvec3 ahead = -dvec3(made.camera.camera_to_world[2]);
    EXPECT_GT(std::max(glm::dot(dvec3(-1, 0.4, 0) - at, ahead), glm::dot(dvec3(1, 0.4, 0) - at, ahead)), 0);
}

TEST(DefaultCamera, StaysOutsideObjectsAndOpenRooms) {
    EXPECT_FALSE(default_camera(block(vec3(1)), 1).inside) << "a solid block";
    EXPECT_FALSE(default_camera(cornell_box(), 1).inside) << "one side is open";
    Scene shell = block(vec3(1));
    add_box(shell, 0, vec3(-3, -0.5f, -3), vec3(3, -0.4f, 3));
    EXPECT_FALSE(default_camera(shell, 1).inside);
    EXPECT_FALSE(default_camera(Scene(), 1).inside);
    EXPECT_FALSE(default_camera(room(), 1, View::outside).inside);
    EXPECT_EQ(choose_camera(room(), {.camera = "outside"}).camera.camera_to_world,
              framing_camera(room(), kUsualAspect).camera_to_world);
}

TEST(DefaultCamera, StandsNeitherBetweenWallsNorAtOpenings) {
    // Walls with a cavity around a court, as Sponza has them, and a room with a window that shows nothing.
    Scene scene = room();
    add_box(scene, 0, {-2.4f, -0.4f, -2.9f}, {2.4f, 3.4f, 2.9f});
    const dvec3 at(default_camera(scene, 16.0 / 9).camera.camera_to_world[3]);
    EXPECT_LT(glm::abs(at.x), 2);
    EXPECT_LT(glm::abs(at.z), 2.5);
    scene.meshes[0].triangles.resize(scene.meshes[0].triangles.size() - 1);
    scene.meshes[0].triangle_material.pop_back();
    const rays::SceneProbe probe(scene);
    const DefaultCamera made = halflight::default_camera(probe, 16.0 / 9, View::inside);
    EXPECT_TRUE(made.inside);
    EXPECT_NEAR(glimpse(probe, made.camera, 16.0 / 9).seen, 1, 1e-9);
}

TEST(DefaultCamera, FramesWhatShowsMoreThanGroundAndStrayTriangles) {
    const Scene objects = [] {
        Scene scene;
        for (int i = 0; i < 30; ++i) {
            const auto x = float(i % 6), z = float(i / 6);
            add_box(scene, add_material(scene, diffuse_material(vec3(0.5f))), {x, 0, z}, {x + 0.5f, 0.6f, z + 0.5f});
        }
        return scene;
    }();
    Scene ground = objects, stray = objects;
    add_box(ground, 0, {-1000, -1, -1000}, {1000, 0, 1000});
    add_quad(stray, 0, {900, 900, 900}, {1, 0, 0}, {0, 1, 0});
    EXPECT_FALSE(default_camera(objects, 1).left_out);
    for (const Scene& scene : {ground, stray}) {
        const DefaultCamera made = default_camera(scene, 1);
        EXPECT_TRUE(made.left_out);
        EXPECT_LT(glm::length(dvec3(made.camera.camera_to_world[3]) - dvec3(3, 0, 2.5)), 30);
    }
}

TEST(DefaultCamera, ReplacesACameraThatSeesNothing) {
    Scene scene = block(vec3(1));
    scene.cameras.push_back(look_at_camera({0, 0, 3}, {0, 0, 9}, {0, 1, 0}, 1));
    scene.cameras.back().name = "away";
    EXPECT_EQ(choose_camera(scene, {}).index, 0u) << "sequences keep the camera of the file";
    const ChosenCamera kept = choose_camera(scene, {.warn_of_blind = true});
    EXPECT_EQ(kept.index, 0u);
    EXPECT_FALSE(kept.warning.empty());
    EXPECT_TRUE(choose_camera(scene, {}).warning.empty());
    const ChosenCamera chosen = choose_camera(scene, {.replace_blind = true});
    EXPECT_FALSE(chosen.index);
    EXPECT_NE(chosen.warning.find("'away'"), std::string::npos);
    EXPECT_TRUE(chosen.options.starts_with("--look-from="));
    scene.cameras[0] = look_at_camera({0, 0, 3}, {0, 0, 0}, {0, 1, 0}, 1);
    EXPECT_EQ(choose_camera(scene, {.replace_blind = true}).index, 0u);
    EXPECT_TRUE(choose_camera(scene, {.warn_of_blind = true}).warning.empty());
}

TEST(Turntable, KeepsTheSceneInThePicture) {
    const Scene scene = block(vec3(4, 1, 1));
    CameraChoice choice;
    choice.aspect = 1;
    choice.turntable = 24;
    const ChosenCamera chosen = choose_camera(scene, choice);
    double most = 0;
    for (int frame = 0; frame < 24; ++frame) {
        const dvec2 seen = extent(scene, turned(chosen.camera, chosen.pivot, 2 * kPi * frame / 24), 1);
        most = std::max({most, seen.x, seen.y});
    }
    EXPECT_LE(most, 0.9 + 1e-6);
    EXPECT_GT(most, 0.85);
}

TEST(Turntable, TurnsAboutItsPivot) {
    const Scene scene = block(vec3(1));
    CameraChoice choice;
    choice.look_from = dvec3(0, 2, 5), choice.look_at = dvec3(1, 0, 0), choice.turntable = 4;
    const ChosenCamera chosen = choose_camera(scene, choice);
    EXPECT_EQ(chosen.pivot, dvec3(1, 0, 0));
    const Camera quarter = turned(chosen.camera, chosen.pivot, kPi / 2);
    EXPECT_NEAR(glm::length(dvec3(quarter.camera_to_world[3]) - dvec3(6, 2, 1)), 0, 1e-12);
    const dvec3 back(quarter.camera_to_world[2]);
    EXPECT_NEAR(glm::length(back - glm::normalize(dvec3(5, 2, 1))), 0, 1e-12) << "it still looks at the pivot";
}

/// Returns the irradiance of a horizontal surface by the map and the sun, by brute force.
dvec3 irradiance(const Sky& sky) {
    dvec3 sum(0);
    const Image& map = sky.environment.map;
    for (int y = 0; y < map.height / 2; ++y)
        for (int x = 0; x < map.width; ++x) {
            // The integral of the cosine over the texel.
            const double upper = std::cos(kPi * y / map.height), lower = std::cos(kPi * (y + 1) / map.height);
            const double weight = (upper * upper - lower * lower) * kPi / map.width;
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
        const double tolerance = preset == SkyPreset::overcast ? 1e-3 : 0.02;
        EXPECT_NEAR(luminance_of(irradiance(sky)), kPi, tolerance * kPi) << name(preset);
        EXPECT_EQ(sky.environment.name, name(preset));
    }
    const Image map = default_sky().map;
    EXPECT_EQ(preset_sky(SkyPreset::overcast).environment.map.pixels, map.pixels);
    EXPECT_EQ(map.at(0, 20)[0], map.at(63, 31)[2]) << "neutral, and constant below the horizon";
}

/// Returns the mean radiance in the directions of a map for which f(elevation, azimuth) is true, radians.
template <class F>
double mean_radiance(const Environment& environment, const F& f) {
    const Image& map = environment.map;
    double sum = 0, solid_angle = 0;
    for (int y = 0; y < map.height; ++y)
        for (int x = 0; x < map.width; ++x) {
            const double phi = 2 * kPi * ((x + 0.5) / map.width - 0.5);  // from +X to +Z
            if (!f(kPi * (0.5 - (y + 0.5) / map.height), kPi / 2 - phi)) continue;
            const double weight = std::sin(kPi * (y + 0.5) / map.height);
            sum += weight * double(map.at(x, y)[0]) * double(environment.color.x);
            solid_angle += weight;
        }
    return sum / solid_angle;
}

TEST(Skies, NeutralLightShowsFormAndKeepsTheExposure) {
    const auto all = [](double, double) { return true; };
    const Environment sky = preset_sky(SkyPreset::neutral, 0).environment;
    EXPECT_NEAR(luminance_of(irradiance({sky})), kPi, 1e-4);
    EXPECT_NEAR(mean_radiance(sky, all), mean_radiance(preset_sky(SkyPreset::overcast).environment, all), 0.005);
    for (std::size_t i = 0; i < sky.map.pixels.size(); i += 3) {
        ASSERT_EQ(sky.map.pixels[i], sky.map.pixels[i + 1]);
        ASSERT_EQ(sky.map.pixels[i], sky.map.pixels[i + 2]);
    }
    // From the point of view at azimuth 0, negative azimuths are on the left of the picture.
    const auto towards = [&](double elevation, double azimuth, double width = 0.2) {
        return mean_radiance(sky, [=](double e, double a) {
            return std::abs(e - elevation) < width && std::abs(std::remainder(a - azimuth, 2 * kPi)) < width;
        });
    };
    const double key = towards(0.6, -0.84), fill = towards(0.25, 1.26, 0.08), front = towards(0.3, 0.6);
    EXPECT_GT(key, 2 * fill);
    EXPECT_GT(fill, 2 * front);
    const double below = mean_radiance(sky, [](double e, double) { return e < 0; });
    EXPECT_LT(below, 0.35);
    EXPECT_GT(towards(-0.05, kPi, 0.05), 1.5 * towards(-0.7, kPi)) << "the background becomes darker downwards";
    // Fixed values: another light would change all pictures of files without lights.
    EXPECT_NEAR(key, 3.06, 0.02);
    EXPECT_NEAR(towards(kPi / 2, 0), 0.62, 0.02);
}

TEST(Skies, NeutralLightFollowsTheCamera) {
    const Image front = preset_sky(SkyPreset::neutral, 10).environment.map,
                right = preset_sky(SkyPreset::neutral, 100).environment.map;
    const int quarter = front.width / 4;  // azimuths grow towards smaller columns
    for (int y = 0; y < front.height; ++y)
        for (int x = 0; x < front.width; ++x)
            ASSERT_NEAR(right.at((x + 3 * quarter) % front.width, y)[0], front.at(x, y)[0], 1e-4) << x << ", " << y;
    const auto azimuth = [](const dvec3& from, const dvec3& up = {0, 1, 0}) {
        return view_azimuth(look_at_camera(from, dvec3(0), up, 1));
    };
    EXPECT_NEAR(azimuth({0, 1, 5}), 0, 1e-9);
    EXPECT_NEAR(azimuth({2, -3, 0}), 90, 1e-9);
    EXPECT_NEAR(azimuth({0, 5, 0}, {-1, 0, 0}), 90, 1e-9) << "+X is at the lower edge of the picture";
    EXPECT_NEAR(azimuth({0, -5, 0}, {1, 0, 0}), 90, 1e-9) << "+X is at the upper edge";
    const Scene scene = block(vec3(1));
    EXPECT_NEAR(view_azimuth(framing_camera(scene)), kFramingAzimuth, 1e-9);
    EXPECT_NEAR(azimuth_of_light(scene, {}), kFramingAzimuth, 1e-9);
    EXPECT_NEAR(azimuth_of_light(scene, {.look_from = dvec3(-3, 1, 0), .look_at = dvec3(0)}), -90, 1e-9);
}

// The table of docs/light.md, Clear sky, at turbidity 2. Published figures of sun and sky are those of IES RP-21
// (1984) for a clear sky. Those of the zenith are from Karayel et al. 1984 with the turbidity of Radiance's
// gensky, 2.45. Those of the twilight are from the Glossary of Meteorology of the American Meteorological Society.
TEST(Skies, ClearSkyHasThePublishedLight) {
    struct Row {
        double elevation;
        double sun, sky, zenith;  // illuminance facing the sun, that of a horizontal surface, lux; luminance, nits
        double x, y;              // CIE chromaticity of the zenith
    };
    constexpr Row kRows[] = {{-5, 0, 18.2, 3.29, 0.233, 0.233},       {0, 0.81, 907, 162, 0.260, 0.272},
                             {5, 14150, 3930, 561, 0.258, 0.271},     {30, 85800, 13640, 1724, 0.253, 0.258},
                             {60, 103200, 17660, 4150, 0.271, 0.279}, {90, 106800, 18820, 36200, 0.300, 0.314}};
    const auto luminances = [](const Atmosphere& air, double elevation) {
        return dvec3(luminance_of(air.sun_illuminance()), luminance_of(air.sky_illuminance()),
                     luminance_of(Atmosphere::radiance(air.light(kPi / 2, 0), std::sin(elevation * kPi / 180))));
    };
    for (const Row& row : kRows) {
        SCOPED_TRACE(row.elevation);
        const Atmosphere air({.elevation = row.elevation, .turbidity = 2});
        const dvec3 found = luminances(air, row.elevation);
        EXPECT_NEAR(found.x, row.sun, 0.01 * row.sun);
        EXPECT_NEAR(found.y, row.sky, 0.01 * row.sky);
        EXPECT_NEAR(found.z, row.zenith, 0.01 * row.zenith);
        const double sine = std::sin(row.elevation * kPi / 180);
        const dvec3 xyz = rgb_to_xyz(kRec709) * Atmosphere::radiance(air.light(kPi / 2, 0), sine);
        const double x = xyz.x / (xyz.x + xyz.y + xyz.z), y = xyz.y / (xyz.x + xyz.y + xyz.z);
        EXPECT_NEAR(x, row.x, 0.001);
        EXPECT_NEAR(y, row.y, 0.001);
        // Clear skylight is close to the CIE daylight locus (Hernandez-Andres et al. 2001, JOSA A 18, p. 412).
        EXPECT_NEAR(y, -3 * x * x + 2.87 * x - 0.275, 0.01);
        if (row.elevation < 5) continue;
        EXPECT_NEAR(found.x / (127500 * std::exp(-0.21 / sine)), 1, row.elevation == 5 ? 0.25 : 0.04);
        EXPECT_NEAR(found.y / (800 + 15500 * std::sqrt(sine)), 1, row.elevation == 5 ? 0.3 : 0.17);
        const double karayel = 1000 * ((1.376 * 2.45 - 1.81) * sine / std::sqrt(1 - sine * sine) + 0.38);
        EXPECT_TRUE(row.elevation == 90 || std::abs(found.z / karayel - 1) < 0.36);
    }
    struct Twilight {
        double elevation, least, most;  // degrees; lux
    };
    for (const auto& [elevation, least, most] :
         {Twilight{-0.83, 410, 585}, Twilight{-6, 2, 3.5}, Twilight{-12, 0.008, 0.008}}) {
        const double lux = luminances(Atmosphere({.elevation = elevation, .turbidity = 2}), elevation).y;
        EXPECT_GT(lux, least / 1.3) << elevation;
        EXPECT_LT(lux, most * 1.7) << elevation;
    }
}

TEST(Skies, SunAndAirAreConsistent) {
    const ClearSky choice{.elevation = 40, .azimuth = 100};
    const Atmosphere air(choice);
    const Sky sky = clear_sky(choice);
    const double by_sky = luminance_of(air.sky_illuminance()),
                 by_sun = std::sin(40 * kPi / 180) * luminance_of(dvec3(sky.sun->intensity));
    EXPECT_NEAR(luminance_of(irradiance(sky)), by_sky + by_sun, 0.01 * by_sky);
    // The disc's mean radiance over its solid angle is the sun's illuminance.
    double disc = 0;
    for (int i = 0; i < 1000; ++i) disc += luminance_of(air.sun_radiance(std::sqrt((i + 0.5) / 1000))) / 1000;
    disc *= 2 * kPi * (1 - std::cos(kSunRadius * kPi / 180));
    EXPECT_NEAR(disc, luminance_of(dvec3(sky.sun->intensity)), 0.001 * disc);
    const dvec3 centre = air.sun_radiance(0), limb = air.sun_radiance(0.9);
    EXPECT_LT(limb.g, 0.7 * centre.g);
    EXPECT_GT(limb.r / limb.b, centre.r / centre.b) << "the limb is redder";
    // Neighbouring texels are alike: across the azimuth where the map begins, at the horizon and at the zenith.
    const Image& map = sky.environment.map;
    for (int y = 0; y < map.height; ++y) ASSERT_NEAR(map.at(0, y)[1] / map.at(map.width - 1, y)[1], 1, 0.03) << y;
    for (int x = 0; x < map.width; ++x)
        ASSERT_GT(map.at(x, map.height / 2)[1], 0.2f * map.at(x, map.height / 2 - 1)[1]) << x;
    const auto lower = [](const Sky& s) { return double(s.environment.map.at(0, 200)[1]); };
    ClearSky changed = choice;
    changed.ground_albedo = 0;
    EXPECT_LT(lower(clear_sky(changed)), 0.2 * lower(sky));
    changed = choice;
    changed.altitude = 8000;
    const Sky high = clear_sky(changed);
    EXPECT_LT(high.environment.map.at(0, 0)[1], 0.5f * map.at(0, 0)[1]) << "the sky is dark there";
    EXPECT_GT(high.sun->intensity.g, 1.2f * sky.sun->intensity.g);
}

TEST(Skies, LowSunsAreRedAndDim) {
    double dimmer = 1e9, redness = 0;
    for (const double elevation : {90.0, 45.0, 20.0, 5.0, 0.0}) {
        const dvec3 sun = Atmosphere({.elevation = elevation}).sun_illuminance();
        EXPECT_LT(luminance_of(sun), dimmer);
        EXPECT_GT(sun.r / luminance_of(sun), redness);
        dimmer = luminance_of(sun);
        redness = sun.r / luminance_of(sun);
    }
}

TEST(Skies, FiniteInTheWholeRange) {
    for (const ClearSky& choice :
         {ClearSky{90, -360, kLeastTurbidity}, ClearSky{1e-3, 123.4, kMostTurbidity, 1}, ClearSky{0, 0, 3, 0},
          ClearSky{30, 360, 2, 0.2, kMostAltitude}, ClearSky{kLeastElevation, 7, 3}}) {
        const Sky sky = clear_sky(choice);
        EXPECT_NO_THROW(validate(scene_of(sky))) << choice.elevation;
        EXPECT_GT(luminance_of(irradiance(sky)), 5e-4) << choice.elevation;
        EXPECT_LT(std::ranges::max(sky.environment.map.pixels), 1e6f) << choice.elevation;
        EXPECT_EQ(sky.sun.has_value(), choice.elevation >= 0);
    }
}

}  // namespace
}  // namespace halflight
