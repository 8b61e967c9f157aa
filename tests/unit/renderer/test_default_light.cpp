// Tests the decision to add a neutral sky, and the texts that name environments.
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <cmath>
#include <cstdint>

#include "api/default_camera.h"
#include "api/default_light.h"
#include "api/halflight/environment_choice.h"
#include "api/halflight/frame_renderer.h"
#include "api/halflight/loaded_scene.h"
#include "tests/support/error_message.h"
#include "tests/support/process.h"
#include "tests/support/scenes.h"
#include "tests/unit/io/gltf_builder.h"

namespace halflight {
namespace {

using namespace test;

/// Returns a grey box of 1 m, a helmet without a head.
Scene helmet() {
    Scene scene;
    add_box(scene, add_material(scene, diffuse_material(vec3(0.5f))), vec3(-0.5f), vec3(0.5f));
    return scene;
}

/// Adds a square of side `side` on the front of the box.
void add_led(Scene& scene, float side, const vec3& radiance) {
    add_quad(scene, add_material(scene, light_material(radiance)), {-side / 2, -side / 2, 0.51f}, {side, 0, 0},
             {0, side, 0});
}

PunctualLight& add_light(Scene& scene, LightType type, float intensity, const dvec3& position) {
    PunctualLight& light = scene.lights.emplace_back();
    light.type = type;
    light.intensity = vec3(intensity);
    light.position = position;
    light.direction = vec3(0, -1, 0);
    return light;
}

/// Returns a closed room of 4 m with a camera inside.
Scene closed_room() {
    Scene scene;
    add_box(scene, add_material(scene, diffuse_material(vec3(0.5f))), vec3(-2), vec3(2));
    scene.cameras.push_back(look_at_camera({0, 0, 1.9}, {0, 0, 0}, {0, 1, 0}, 1));
    return scene;
}

bool needs_sky(const Scene& scene) {
    const DefaultLight light = default_light(scene);
    EXPECT_TRUE(light.lamps.empty());
    return light.sky;
}

TEST(NeutralSky, AddedWhereThereIsNoLight) {
    EXPECT_TRUE(needs_sky(helmet()));
    Scene scene = helmet();
    scene.environment.color = vec3(1e-6f);
    EXPECT_FALSE(needs_sky(scene)) << "an environment of the file stays, however dim";
}

TEST(NeutralSky, AddedToSmallEmissiveDetails) {
    Scene scene = helmet();
    add_led(scene, 0.05f, vec3(1));
    EXPECT_TRUE(needs_sky(scene));
    add_led(scene, 0.05f, vec3(100));
    EXPECT_TRUE(needs_sky(scene)) << "it faces away from everything";
}

TEST(NeutralSky, AddedWhereTextureBlackensTheEmission) {
    Scene scene = helmet();
    scene.images.push_back({"black", 1, 1, {0, 0, 0, 255}});
    scene.materials[0].emission = vec3(1);
    EXPECT_FALSE(needs_sky(scene)) << "all of it emits, and a sky adds nothing that has to be seen";
    scene.materials[0].emission_texture.image = 0;
    EXPECT_TRUE(needs_sky(scene));
}

TEST(NeutralSky, AddedWhereLabelsOutshineALamp) {
    Scene scene = helmet();
    add_light(scene, LightType::point, 1.5f, {0, 3, 3});
    EXPECT_FALSE(needs_sky(scene)) << "the exposure can be raised";
    add_led(scene, 0.5f, vec3(1));
    EXPECT_TRUE(needs_sky(scene));
    scene.lights[0].intensity *= 40;
    EXPECT_FALSE(needs_sky(scene));
}

TEST(NeutralSky, AddedWhereOnlyDisplaysGlow) {
    // A label on a wall lights a quarter of the floor in front of it by a tenth of its radiance.
    Scene scene;
    add_quad(scene, add_material(scene, diffuse_material(vec3(0.5f))), {-1, 0, 0}, {0, 0, 2}, {2, 0, 0});
    const int label = add_material(scene, light_material(vec3(1)));
    add_quad(scene, label, {-1, 0, 0}, {2, 0, 0}, {0, 1, 0});
    scene.cameras.push_back(look_at_camera({0, 2, 4}, {0, 0.5, 1}, {0, 1, 0}, 0.8));
    EXPECT_FALSE(needs_sky(scene)) << "a lamp without a texture";
    scene.images.push_back({"label", 1, 1, {255, 255, 255, 255}});
    const auto glow = static_cast<std::size_t>(label);
    scene.materials[glow].emission_texture.image = 0;
    scene.meshes.back().uvs[0].resize(4);
    EXPECT_FALSE(needs_sky(scene)) << "it lights most of the floor";
    scene.meshes.back().positions[2].y = scene.meshes.back().positions[3].y = 0.35f;
    EXPECT_TRUE(needs_sky(scene));
    scene.materials[glow].emission = vec3(1.01f);
    EXPECT_FALSE(needs_sky(scene)) << "a strength makes it a lamp";
    scene.materials[glow].emission = vec3(1);
    scene.materials[glow].emission_texture.image = kNone;
    EXPECT_FALSE(needs_sky(scene)) << "a lamp without a texture";
    scene.materials[glow].emission_texture.image = 0;
    add_light(scene, LightType::point, 1e-6f, {0, 3, 3});
    EXPECT_FALSE(needs_sky(scene)) << "the file has a lamp";
}

TEST(SceneTables, ScenesBeyondTheirLimitsGoToPages) {
    SceneSize size;
    size.stored = std::size_t{1} << 25, size.vertex_texels = std::size_t{1} << 27;
    EXPECT_NO_THROW(check_tables(size, "large.glb"));
    SceneSize triangles = size, texels = size;
    ++triangles.stored, ++texels.vertex_texels;
    bool paged = false;
    for (const SceneSize& larger : {triangles, texels}) {
        EXPECT_THROW(check_tables(larger, "large.glb"), BudgetError);
        paged = false;
        load_whole_or_paged(
            {.scene = "large.glb"}, [&] { check_tables(larger, "large.glb"); }, [&] { paged = true; });
        EXPECT_TRUE(paged);
    }
}

TEST(SceneTables, FilesBeyondThemAreRefusedBeforeTheyAreDecoded) {
    GltfBuilder b;  // each point becomes 80 triangles
    b.add_mesh({{"POSITION", b.floats("VEC3", {0, 0, 0, 1, 0, 0})}})["mode"] = 0;
    b.json["meshes"][0]["primitives"][0]["indices"] = b.accessor("SCALAR", kU8, std::vector<std::uint8_t>(1000000, 1));
    const TemporaryFolder folder;
    const std::filesystem::path path = folder / "points.glb";
    write_text(path, b.glb());
    MemoryLedger& memory = MemoryLedger::process();
    const std::size_t limit = memory.limit();
    memory.set_limit(SIZE_MAX);
    const std::string message = error_message([&] { const SceneFile file(path, {.line_width = 1}); });
    memory.set_limit(limit);
    EXPECT_EQ(message, path.string() + ": has 80000000 triangles and 42000000 texels of vertex attributes; tables "
                                       "without pages hold 33554432 and 134217728");
}

TEST(NeutralSky, AddedToSeeThroughScenes) {
    Scene scene = helmet();
    add_led(scene, 0.02f, vec3(1));
    scene.materials[0].transmission = 1;
    EXPECT_TRUE(needs_sky(scene)) << "glass";
    scene.materials[0].transmission = 0;
    scene.materials[0].alpha_mode = AlphaMode::blend;
    scene.materials[0].base_color.a = 0.4f;
    EXPECT_TRUE(needs_sky(scene)) << "a veil";
    add_light(scene, LightType::directional, 3, {}).direction = glm::normalize(vec3(0, -1, -1));
    EXPECT_FALSE(needs_sky(scene)) << "a veil in the sun";
}

TEST(NeutralSky, EntersByWindows) {
    for (const float width : {0.4f, 2.4f}) {
        Scene scene;
        const int wall = add_material(scene, diffuse_material(vec3(0.5f)));
        const float w = width / 2;
        add_quad(scene, wall, {-2, -2, -2}, {0, 0, 4}, {4, 0, 0});
        add_quad(scene, wall, {-2, 2, -2}, {4, 0, 0}, {0, 0, 4});
        add_quad(scene, wall, {-2, -2, -2}, {0, 4, 0}, {0, 0, 4});
        add_quad(scene, wall, {2, -2, -2}, {0, 0, 4}, {0, 4, 0});
        add_quad(scene, wall, {-2, -2, 2}, {0, 4, 0}, {4, 0, 0});
        add_quad(scene, wall, {-2, -2, -2}, {4, 0, 0}, {0, 2 - w, 0});
        add_quad(scene, wall, {-2, w, -2}, {4, 0, 0}, {0, 2 - w, 0});
        add_quad(scene, wall, {-2, -w, -2}, {2 - w, 0, 0}, {0, width, 0});
        add_quad(scene, wall, {w, -w, -2}, {2 - w, 0, 0}, {0, width, 0});
        scene.cameras.push_back(look_at_camera({1.5, 0, 1.9}, {0, -0.5, -1}, {0, 1, 0}, 1));
        add_light(scene, LightType::point, 1e-4f, {0, 1, 0});
        EXPECT_EQ(needs_sky(scene), width > 1) << width;
        scene.lights.clear();
        EXPECT_EQ(default_light(scene).lamps.empty(), width > 1) << width;
    }
}

TEST(NeutralSky, SmallEmittersHoldNoExposureDown) {
    Scene scene = helmet();
    add_light(scene, LightType::point, 1.5f, {0, 3, 3});
    for (const float side : {0.02f, 0.04f}) {
        add_led(scene, side, vec3(1));
        EXPECT_FALSE(needs_sky(scene)) << side;
    }
}

TEST(NeutralSky, UnlitSurfacesAreLight) {
    Scene scene = helmet();
    Material panel = diffuse_material(vec3(1));
    panel.unlit = true;
    add_quad(scene, add_material(scene, panel), {-5, 2, -5}, {10, 0, 0}, {0, 0, 10});
    scene.cameras.push_back(look_at_camera({3, 0, 4}, {0, 0, 0}, {0, 1, 0}, 0.4));
    EXPECT_FALSE(needs_sky(scene));
    scene.materials.back().base_color = vec4(0, 0, 0, 1);
    EXPECT_TRUE(needs_sky(scene));
}

TEST(NeutralSky, AddedWhereAllGlowsDimly) {
    Scene scene = helmet();
    scene.materials[0].emission = vec3(0.02f, 0, 0);
    EXPECT_TRUE(needs_sky(scene));
}

TEST(NeutralSky, ColoursOfVerticesMakeShadesTransparent) {
    Scene scene = helmet();
    Material glass = diffuse_material(vec3(0.5f));
    glass.alpha_mode = AlphaMode::blend;
    add_light(scene, LightType::point, 1000, {0, 3, 3});
    add_box(scene, add_material(scene, glass), {-0.2f, 2.8f, 2.8f}, {0.2f, 3.2f, 3.2f});
    EXPECT_TRUE(needs_sky(scene));
    Mesh& shade = scene.meshes.back();
    shade.colors.assign(shade.positions.size(), vec4(1, 1, 1, 0.02f));
    EXPECT_FALSE(needs_sky(scene));
}

/// Returns the greatest resident memory of the process so far, bytes.
std::size_t peak_bytes() {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return static_cast<std::size_t>(usage.ru_maxrss) * 1024;
}

TEST(NeutralSky, ManyInstancesOfEmissiveTrianglesTakeLittleMemory) {
    // A panel of a few thousand triangles, once and thousands of times, above a box. All give the same light.
    constexpr int kSide = 40, kInstances = 2000;  // 6.4 million emissive triangles
    Scene scene = helmet();
    Mesh& panel = scene.meshes.emplace_back();
    const auto material = static_cast<std::uint32_t>(add_material(scene, light_material(vec3(1))));
    for (int y = 0; y <= kSide; ++y)
        for (int x = 0; x <= kSide; ++x) {
            panel.positions.emplace_back(float(x) / kSide - 0.5f, 2.0f, float(y) / kSide - 0.5f);
            panel.normals.emplace_back(0, -1, 0);
        }
    for (int i = 0; i < kSide * kSide; ++i) {
        const auto a = static_cast<std::uint32_t>(i / kSide * (kSide + 1) + i % kSide);
        panel.triangles.push_back({a, a + 1, a + kSide + 2});
        panel.triangles.push_back({a, a + kSide + 2, a + kSide + 1});
        panel.triangle_material.insert(panel.triangle_material.end(), 2, material);
    }
    Instance instance;
    instance.mesh = static_cast<int>(scene.meshes.size()) - 1;
    scene.cameras.push_back(look_at_camera({0, 1, 3}, {0, 0, 0}, {0, 1, 0}, 0.6));
    scene.instances.push_back(instance);
    const bool expected = needs_sky(scene);
    scene.instances.insert(scene.instances.end(), kInstances - 1, instance);
    scene.materials[material].emission /= float(kInstances);
    [[maybe_unused]] const std::size_t before = peak_bytes();
    EXPECT_EQ(needs_sky(scene), expected);
#ifndef HALFLIGHT_SANITIZED
    EXPECT_LT(peak_bytes() - before, std::size_t{96} << 20);
#endif
}

TEST(NeutralSky, AddedToLampsFarAway) {
    Scene scene = helmet();
    add_light(scene, LightType::point, 60, {0, 300, 300});
    EXPECT_TRUE(needs_sky(scene));
    scene.lights[0].position = {0, 3, 3};
    EXPECT_FALSE(needs_sky(scene));
}

TEST(NeutralSky, AddedToLampsThatAreShut) {
    Scene scene = helmet();
    const int shade = add_material(scene, diffuse_material(vec3(0.5f)));
    add_light(scene, LightType::point, 1e4f, {0, 3, 3});
    add_box(scene, shade, {-0.2f, 2.8f, 2.8f}, {0.2f, 3.2f, 3.2f});
    EXPECT_TRUE(needs_sky(scene));
    scene.materials[static_cast<std::size_t>(shade)].transmission = 1;
    EXPECT_FALSE(needs_sky(scene)) << "light passes a shade of glass";
    scene.materials[static_cast<std::size_t>(shade)].metallic = 1;
    EXPECT_TRUE(needs_sky(scene)) << "metal transmits no light";
    scene.materials[static_cast<std::size_t>(shade)].metallic = 0;
    scene.materials[static_cast<std::size_t>(shade)].transmission = 0;
    scene.materials[static_cast<std::size_t>(shade)].diffuse_transmission = 0.6f;
    EXPECT_FALSE(needs_sky(scene)) << "light passes a shade of paper";
    scene.materials[static_cast<std::size_t>(shade)].diffuse_transmission = 0;
    scene.materials[static_cast<std::size_t>(shade)].alpha_mode = AlphaMode::blend;
    scene.materials[static_cast<std::size_t>(shade)].base_color.a = 0.1f;
    EXPECT_FALSE(needs_sky(scene)) << "light passes a thin shade";
}

TEST(NeutralSky, NotAddedToRoomsWithALamp) {
    for (const float candela : {100.0f, 1.0f, 1e-3f}) {
        Scene scene = closed_room();
        add_light(scene, LightType::point, candela, {0, 1, 0});
        EXPECT_FALSE(needs_sky(scene)) << candela << " cd: no sky can enter";
    }
    EXPECT_FALSE(needs_sky(cornell_box()));
}

TEST(CameraLamps, AddedToClosedScenesWithoutLight) {
    Scene scene = closed_room();
    scene.cameras.push_back(look_at_camera({0, 0, -1.9}, {0, 0, 0}, {0, 1, 0}, 1));
    const DefaultLight light = default_light(scene);
    EXPECT_FALSE(light.sky) << "it cannot enter";
    ASSERT_EQ(light.lamps.size(), 2U);
    for (std::size_t i = 0; i < 2; ++i) {
        EXPECT_EQ(light.lamps[i].position, dvec3(scene.cameras[i].camera_to_world[3]));
        EXPECT_TRUE(light.lamps[i].of_environment) << "another environment replaces it";
        EXPECT_NEAR(light.lamps[i].intensity.x, light.lamps[0].intensity.x, 1) << "the room is symmetric";
    }
    scene.lights = light.lamps;
    const LightShares shares = light_shares(scene, rays::SceneProbe(scene), scene.cameras);
    EXPECT_EQ(shares.lit, 1);
    // The walls are 2 m to 4.5 m away from both lamps.
    EXPECT_GT(light.lamps[0].intensity.x, 4);
    EXPECT_LT(light.lamps[0].intensity.x, kPi * 4.5 * 4.5);
    scene.lights.clear();
    scene.cameras.clear();
    EXPECT_TRUE(needs_sky(scene)) << "there is no camera inside";
    scene.cameras.push_back(look_at_camera({0, 0, 9}, {0, 0, 0}, {0, 1, 0}, 1));
    EXPECT_TRUE(needs_sky(scene)) << "the room is seen from outside";
    Scene open = closed_room();
    std::erase_if(open.meshes[0].triangles, [&](const uvec3& t) {
        return glm::all(glm::greaterThan(open.meshes[0].positions[t.x], vec3(-3, 1, -3))) &&
               glm::all(glm::greaterThan(open.meshes[0].positions[t.y], vec3(-3, 1, -3))) &&
               glm::all(glm::greaterThan(open.meshes[0].positions[t.z], vec3(-3, 1, -3)));
    });
    ASSERT_LT(open.meshes[0].triangles.size(), 12U);
    open.meshes[0].triangle_material.resize(open.meshes[0].triangles.size());
    EXPECT_TRUE(needs_sky(open)) << "the room has no ceiling";
}

TEST(NeutralSky, NotAddedUnderASunOrASpot) {
    Scene scene = helmet();
    add_light(scene, LightType::directional, 2000, {}).direction = glm::normalize(vec3(0, -1, -1));
    EXPECT_FALSE(needs_sky(scene));
    scene = helmet();
    add_quad(scene, 0, {-10, -0.5f, 10}, {20, 0, 0}, {0, 0, -20});
    add_light(scene, LightType::spot, 500, {0, 6, 2}).outer_cone = 0.8f;
    scene.cameras.push_back(look_at_camera({3, 3, 6}, {0, 0, 0}, {0, 1, 0}, 1));
    EXPECT_FALSE(needs_sky(scene)) << "a stage: most of the floor is dark";
}

TEST(NeutralSky, IsRepeatable) {
    Scene scene = helmet();
    add_light(scene, LightType::point, 0.12f, {0, 2, 2});
    const rays::SceneProbe probe(scene);
    const std::vector<Camera> cameras = {framing_camera(scene)};
    const LightShares once = light_shares(scene, probe, cameras), again = light_shares(scene, probe, cameras);
    EXPECT_EQ(once.lit, again.lit);
    EXPECT_EQ(once.sky, again.sky);
}

TEST(NeutralSky, FarFromTheOriginAndTiny) {
    for (const double scale : {1e-6, 1.0, 1e6}) {
        Scene scene = helmet();
        add_led(scene, 0.05f, vec3(1));
        for (Instance& instance : scene.instances) {
            instance.object_to_world = dmat4(scale);
            instance.object_to_world[3] = dvec4(1e6 * scale, 0, -1e6 * scale, 1);
        }
        EXPECT_TRUE(needs_sky(scene)) << scale;
    }
}

TEST(NeutralSky, EmptyAndFlatScenes) {
    Scene scene;
    EXPECT_TRUE(needs_sky(scene));
    add_light(scene, LightType::point, 1, {});
    EXPECT_FALSE(needs_sky(scene)) << "nothing is seen";
    scene = helmet();
    scene.instances[0].object_to_world = dmat4(0);
    scene.instances[0].object_to_world[3].w = 1;
    add_light(scene, LightType::point, 1, {});
    EXPECT_NO_THROW(needs_sky(scene));
}

TEST(DefaultBounces, MoreWhereSomeMaterialIsSolid) {
    Scene scene = helmet();
    Material& material = scene.materials[0];
    EXPECT_EQ(default_bounces(scene), kBounces);
    material.transmission = 1;
    EXPECT_EQ(default_bounces(scene), kBounces) << "a thin wall";
    material.thickness = 0.1f;
    EXPECT_EQ(default_bounces(scene), kBouncesOfSolids);
    material.metallic = 1;
    EXPECT_EQ(default_bounces(scene), kBounces) << "metal transmits no light";
}

TEST(Environment, TheSunBelongsToTheSky) {
    Scene scene = helmet();
    add_light(scene, LightType::point, 1, {0, 2, 2});
    set_environment(scene, ClearSky{.elevation = 30, .azimuth = 90}, {});
    ASSERT_EQ(scene.lights.size(), 2U);
    EXPECT_NEAR(scene.lights[1].direction.x, -std::sqrt(0.75), 1e-6) << "it shines from +X, the east";
    EXPECT_NEAR(scene.lights[1].direction.y, -0.5, 1e-6);
    const Scene lit = scene;
    apply({.environment_rotation = 90, .environment_intensity = 0.5f}, scene);
    EXPECT_NEAR(scene.lights[1].direction.z, -std::sqrt(0.75), 1e-6) << "turned to the right: from the south";
    EXPECT_EQ(scene.lights[1].intensity, 0.5f * lit.lights[1].intensity);
    EXPECT_EQ(scene.lights[0].intensity, lit.lights[0].intensity);
    // The sun stays in the brightest place of the map.
    const Image& map = scene.environment.map;
    double most = 0;
    dvec3 towards(0);
    for (int y = 0; y < map.height; ++y)
        for (int x = 0; x < map.width; ++x) {
            if (double(map.at(x, y)[1]) <= most) continue;
            most = double(map.at(x, y)[1]);
            const double phi = 2 * kPi * ((x + 0.5) / map.width - 0.5), theta = kPi * (y + 0.5) / map.height;
            towards = {std::sin(theta) * std::cos(phi), std::cos(theta), std::sin(theta) * std::sin(phi)};
        }
    EXPECT_GT(-glm::dot(towards, dvec3(scene.lights[1].direction)), 0.999);
    Scene again = lit;
    set_environment(again, SkyPreset::overcast, {});
    EXPECT_EQ(again.lights.size(), 1U) << "another environment takes the sun away";
}

TEST(Environment, TheSunOfThePresetIsToTheRightOfTheDefaultCamera) {
    const Scene scene = helmet();
    const dmat4 camera = default_camera(scene, 1).camera.camera_to_world;
    const dvec3 towards = -dvec3(preset_sky(SkyPreset::sky).sun->direction);
    EXPECT_GT(glm::dot(towards, dvec3(camera[0])), 0.3) << "right";
    EXPECT_GT(glm::dot(towards, dvec3(camera[2])), 0.3) << "behind";
}

TEST(Environment, Texts) {
    const auto choice = [](const char* text) { return parse_environment("--env", text); };
    EXPECT_EQ(choice("none"), EnvironmentChoice(vec3(0)));
    EXPECT_EQ(choice("studio"), EnvironmentChoice(SkyPreset::studio));
    EXPECT_EQ(choice("overcast"), EnvironmentChoice(SkyPreset::overcast));
    EXPECT_EQ(choice("./studio"), EnvironmentChoice(std::filesystem::path("./studio")));
    EXPECT_EQ(choice("white"), EnvironmentChoice(vec3(1)));
    EXPECT_EQ(choice("#fff"), EnvironmentChoice(vec3(1)));
    EXPECT_NEAR(std::get<vec3>(choice("#808080")).g, 0.2158605f, 1e-6) << "sRGB-encoded (IEC 61966-2-1)";
    EXPECT_EQ(choice("#880000"), choice("#800"));
    EXPECT_EQ(choice("0.1,2,3"), EnvironmentChoice(vec3(0.1f, 2, 3)));
    EXPECT_EQ(choice("sky.hdr"), EnvironmentChoice(std::filesystem::path("sky.hdr")));
    const auto message = [](const char* text) { return error_message([&] { parse_environment("--env", text); }); };
    EXPECT_EQ(message(""), "--env: expects the name of a file, a colour or a preset");
    EXPECT_EQ(message("#12345"), "--env: expects #rgb or #rrggbb, not '#12345'");
    EXPECT_EQ(message("#ggg"), "--env: expects #rgb or #rrggbb, not '#ggg'");
    EXPECT_EQ(message("1,2,1e99"), "--env: expects a radiance of at most 3e38, not '1,2,1e99'");
    const ClearSky sky = parse_clear_sky("--sky", "12.5,-90,4");
    EXPECT_EQ(sky, (ClearSky{12.5, -90, 4}));
    EXPECT_EQ(parse_clear_sky("--sky", text(sky)), sky);
    EXPECT_EQ(parse_clear_sky("--sky", "12.5,-90").turbidity, ClearSky().turbidity);
    const auto refused = [](const char* text) { return error_message([&] { parse_clear_sky("--sky", text); }); };
    for (const char* text : {"", "45", "45,0,3,1", "a,b", "45,0,", "nan,0"})
        EXPECT_EQ(refused(text),
                  std::string("--sky: expects ELEVATION,AZIMUTH or ELEVATION,AZIMUTH,TURBIDITY, not '") + text + "'");
    EXPECT_EQ(refused("-1,0"), "--sky: expects an elevation from 0 to 90, not '-1,0'");
    EXPECT_EQ(refused("1,1e9"), "--sky: expects an azimuth from -360 to 360, not '1,1e9'");
    EXPECT_EQ(refused("1,0,1.9"), "--sky: expects a turbidity from 2 to 10, not '1,0,1.9'");
}

}  // namespace
}  // namespace halflight
