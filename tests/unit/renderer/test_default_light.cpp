// Tests the decision to add a neutral sky, and the texts that name environments.
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "api/first_picture/default_camera.h"
#include "api/first_picture/default_light.h"
#include "api/halflight/environment_choice.h"
#include "api/halflight/frame_renderer.h"
#include "api/halflight/loaded_scene.h"
#include "api/scene/blocked_light.h"
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
Scene with_led(Scene scene, float side, float radiance) {
    add_quad(scene, add_material(scene, light_material(vec3(radiance))), {-side / 2, -side / 2, 0.51f}, {side, 0, 0},
             {0, side, 0});
    return scene;
}

PunctualLight& add_light(Scene& scene, LightType type, float intensity, const dvec3& position) {
    PunctualLight& light = scene.lights.emplace_back();
    light.type = type;
    light.intensity = vec3(intensity);
    light.position = position;
    light.direction = vec3(0, -1, 0);
    return light;
}

Scene with_lamp(Scene scene, float candela, const dvec3& position = {0, 3, 3}) {
    add_light(scene, LightType::point, candela, position);
    return scene;
}

Scene with_sun(Scene scene, float radiance) {
    add_light(scene, LightType::directional, radiance, {}).direction = glm::normalize(vec3(0, -1, -1));
    return scene;
}

/// Returns the scene with a changed material.
template <class Change>
Scene with_material(Scene scene, std::size_t material, Change&& change) {
    change(scene.materials.at(material));
    return scene;
}

/// Returns a closed room of 4 m with a camera inside.
Scene closed_room() {
    Scene scene;
    add_box(scene, add_material(scene, diffuse_material(vec3(0.5f))), vec3(-2), vec3(2));
    scene.materials[0].double_sided = true;
    scene.cameras.push_back(look_at_camera({0, 0, 1.9}, {0, 0, 0}, {0, 1, 0}, 1));
    return scene;
}

/// Returns the lamps that a scene gets.
std::vector<PunctualLight> lamps_of(Scene scene, const AddedLight& added = {}) {
    std::erase_if(scene.lights, [](const PunctualLight& light) { return !light.of_environment; });
    set_environment(scene, {}, {}, added);
    return scene.lights;
}

bool needs_sky(const Scene& scene) {
    Scene lit = scene;
    set_environment(lit, {}, {});
    EXPECT_EQ(lit.lights.size(), scene.lights.size()) << "lamps";
    return scene.environment.black() && !lit.environment.black();
}

TEST(NeutralSky, AddedWhereThereIsTooLittleLight) {
    EXPECT_TRUE(needs_sky(helmet()));
    EXPECT_TRUE(needs_sky(with_led(helmet(), 0.05f, 1))) << "a small light";
    EXPECT_TRUE(needs_sky(with_led(with_led(helmet(), 0.05f, 1), 0.05f, 100))) << "it faces away from everything";
    EXPECT_TRUE(needs_sky(with_material(helmet(), 0, [](Material& m) { m.emission = vec3(0.02f, 0, 0); }))) << "dim";
    EXPECT_TRUE(needs_sky(with_lamp(helmet(), 60, {0, 300, 300}))) << "a lamp far away";
    Scene scene = with_material(helmet(), 0, [](Material& m) { m.emission = vec3(1); });
    EXPECT_FALSE(needs_sky(scene)) << "all of it emits, and a sky adds nothing that has to be seen";
    scene.images.push_back({"black", 1, 1, {0, 0, 0, 255}});
    scene.materials[0].emission_texture.image = 0;
    EXPECT_TRUE(needs_sky(scene)) << "a texture blackens the emission";
}

TEST(NeutralSky, NotAddedWhereThereIsLight) {
    EXPECT_FALSE(needs_sky(with_lamp(helmet(), 60)));
    EXPECT_FALSE(needs_sky(with_sun(helmet(), 2000)));
    EXPECT_FALSE(needs_sky(cornell_box()));
    for (const float candela : {100.0f, 1.0f, 1e-3f})
        EXPECT_FALSE(needs_sky(with_lamp(closed_room(), candela, {0, 1, 0}))) << candela << " cd: no sky can enter";
    Scene dim = helmet();
    dim.environment.color = vec3(1e-6f);
    EXPECT_FALSE(needs_sky(dim)) << "an environment of the file stays, however dim";
    Scene stage = helmet();
    add_quad(stage, 0, {-10, -0.5f, 10}, {20, 0, 0}, {0, 0, -20});
    add_light(stage, LightType::spot, 500, {0, 6, 2}).outer_cone = 0.8f;
    stage.cameras.push_back(look_at_camera({3, 3, 6}, {0, 0, 0}, {0, 1, 0}, 1));
    EXPECT_FALSE(needs_sky(stage)) << "most of the floor is dark";
}

TEST(NeutralSky, AddedWhereLabelsOutshineALamp) {
    const Scene lamp = with_lamp(helmet(), 1.5f);
    EXPECT_FALSE(needs_sky(lamp)) << "the exposure can be raised";
    for (const float side : {0.02f, 0.04f})
        EXPECT_FALSE(needs_sky(with_led(lamp, side, 1))) << "small emitters hold no exposure down";
    EXPECT_TRUE(needs_sky(with_led(lamp, 0.5f, 1)));
    EXPECT_FALSE(needs_sky(with_led(with_lamp(helmet(), 60), 0.5f, 1)));
}

TEST(NeutralSky, AddedWhereOnlyDisplaysGlow) {
    // A label on a wall lights a quarter of the floor in front of it by a tenth of its radiance.
    Scene scene;
    add_quad(scene, add_material(scene, diffuse_material(vec3(0.5f))), {-1, 0, 0}, {0, 0, 2}, {2, 0, 0});
    add_quad(scene, add_material(scene, light_material(vec3(1))), {-1, 0, 0}, {2, 0, 0}, {0, 1, 0});
    scene.images.push_back({"label", 1, 1, {255, 255, 255, 255}});
    scene.cameras.push_back(look_at_camera({0, 2, 4}, {0, 0.5, 1}, {0, 1, 0}, 0.8));
    EXPECT_FALSE(needs_sky(scene)) << "a lamp without a texture";
    scene.materials[1].emission_texture.image = 0;
    EXPECT_FALSE(needs_sky(scene)) << "it lights most of the floor";
    scene.meshes[1].positions[2].y = scene.meshes[1].positions[3].y = 0.35f;
    EXPECT_TRUE(needs_sky(scene));
}

TEST(NeutralSky, AddedToSeeThroughScenes) {
    const Scene led = with_led(helmet(), 0.02f, 1);
    EXPECT_TRUE(needs_sky(with_material(led, 0, [](Material& m) { m.transmission = 1; }))) << "glass";
    const Scene veil =
        with_material(led, 0, [](Material& m) { m.alpha_mode = AlphaMode::blend, m.base_color.a = 0.4f; });
    EXPECT_TRUE(needs_sky(veil));
    EXPECT_FALSE(needs_sky(with_sun(veil, 3)));
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
        EXPECT_EQ(lamps_of(scene).empty(), width > 1) << width;
    }
}

TEST(NeutralSky, UnlitSurfacesAreLight) {
    Scene scene = helmet();
    Material panel = diffuse_material(vec3(1));
    panel.unlit = true;
    add_quad(scene, add_material(scene, panel), {-5, 2, -5}, {10, 0, 0}, {0, 0, 10});
    scene.cameras.push_back(look_at_camera({3, 0, 4}, {0, 0, 0}, {0, 1, 0}, 0.4));
    EXPECT_FALSE(needs_sky(scene));
    EXPECT_TRUE(needs_sky(with_material(scene, 1, [](Material& m) { m.base_color = vec4(0, 0, 0, 1); })));
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

TEST(NeutralSky, AddedToLampsThatAreShut) {
    Scene scene = with_lamp(helmet(), 1e4f);
    add_box(scene, add_material(scene, diffuse_material(vec3(0.5f))), {-0.2f, 2.8f, 2.8f}, {0.2f, 3.2f, 3.2f});
    const auto shade = [&](auto&& change) { return needs_sky(with_material(scene, 1, change)); };
    EXPECT_TRUE(needs_sky(scene));
    EXPECT_FALSE(shade([](Material& m) { m.transmission = 1, m.roughness = 0; })) << "light passes a shade of glass";
    EXPECT_FALSE(shade([](Material& m) { m.transmission = 1; })) << "frosted glass scatters light";
    EXPECT_TRUE(shade([](Material& m) { m.transmission = m.thickness = 1, m.roughness = 0; })) << "nor solid glass";
    EXPECT_TRUE(shade([](Material& m) { m.transmission = m.metallic = 1; })) << "metal transmits no light";
    EXPECT_FALSE(shade([](Material& m) { m.diffuse_transmission = 0.6f; })) << "light passes a shade of paper";
    EXPECT_FALSE(shade([](Material& m) { m.alpha_mode = AlphaMode::blend, m.base_color.a = 0.1f; })) << "a thin shade";
    scene.materials[1].alpha_mode = AlphaMode::blend;
    EXPECT_TRUE(needs_sky(scene));
    scene.meshes.back().colors.assign(scene.meshes.back().positions.size(), vec4(1, 1, 1, 0.02f));
    EXPECT_FALSE(needs_sky(scene)) << "vertices are transparent";
}

TEST(BlockedLights, NamesGlassBeforeATenthOfTheSurfaces) {
    // A floor seen from above under a pane of solid glass as wide as a share of the floor.
    const auto lines = [](float share) {
        Scene scene;
        const std::uint32_t white = add_material(scene, diffuse_material(vec3(0.5f)));
        Material glass = diffuse_material(vec3(1));
        glass.transmission = glass.thickness = 1, glass.roughness = 0;
        add_quad(scene, white, {-1, 0, 1}, {2, 0, 0}, {0, 0, -2});
        add_box(scene, add_material(scene, glass), {-1, 2, -1}, {-1 + 2 * share, 2.1f, 1});
        add_light(scene, LightType::directional, 1, {}).direction = vec3(0, -1, 0);
        const std::vector<Camera> cameras = {look_at_camera({0, 1.9, 0}, {0, 0, 0}, {0, 0, -1}, 1.05)};
        return blocked_lights(rays::LazyProbe(scene), scene, cameras);
    };
    EXPECT_TRUE(lines(0).empty());
    EXPECT_TRUE(lines(0.05f).empty());
    const std::vector<std::string> some = lines(0.5f);
    ASSERT_EQ(some.size(), 1u);
    EXPECT_NE(some[0].find("light 0: glass, material 1, which is solid, is before 50 %"), std::string::npos) << some[0];
    EXPECT_EQ(lines(1).size(), 1u);
}

TEST(NeutralSky, IsRepeatable) {
    const Scene scene = with_lamp(helmet(), 0.12f, {0, 2, 2});
    const rays::SceneProbe probe(scene);
    const std::vector<Camera> cameras = {framing_camera(scene)};
    const LightShares once = light_shares(probe, cameras), again = light_shares(probe, cameras);
    EXPECT_EQ(std::pair(once.visible, once.bright), std::pair(again.visible, again.bright));
}

TEST(NeutralSky, EmptyFlatAndTinyScenes) {
    EXPECT_TRUE(needs_sky(Scene()));
    EXPECT_FALSE(needs_sky(with_lamp(Scene(), 1))) << "nothing is seen";
    Scene flat = with_lamp(helmet(), 1);
    flat.instances[0].object_to_world = dmat4(0);
    flat.instances[0].object_to_world[3].w = 1;
    EXPECT_NO_THROW(needs_sky(flat));
    for (const double scale : {1e-6, 1.0, 1e6}) {  // far from the origin
        Scene scene = with_led(helmet(), 0.05f, 1);
        for (Instance& instance : scene.instances) {
            instance.object_to_world = dmat4(scale);
            instance.object_to_world[3] = dvec4(1e6 * scale, 0, -1e6 * scale, 1);
        }
        EXPECT_TRUE(needs_sky(scene)) << scale;
    }
}

TEST(RoomLamps, LightClosedScenes) {
    Scene scene = closed_room();
    const std::vector<PunctualLight> lamps = lamps_of(scene);
    ASSERT_GE(lamps.size(), 3U) << "shadows are softer with several";
    double nearest = 1e9;
    for (const PunctualLight& lamp : lamps) {
        EXPECT_TRUE(lamp.of_environment) << "another environment replaces it";
        const dvec3 to_walls = 2.0 - glm::abs(lamp.position);
        EXPECT_GT(std::min({to_walls.x, to_walls.y, to_walls.z}), 0.3) << "no wall is burnt";
        nearest = std::min(nearest, glm::length(lamp.position - dvec3(scene.cameras[0].camera_to_world[3])));
    }
    EXPECT_GT(nearest, 0.3);
    Scene lit = scene;
    lit.lights = lamps;
    EXPECT_EQ(light_shares(rays::SceneProbe(lit), lit.cameras).visible, 1);
    EXPECT_TRUE(lamps_of(scene, {.lamps = false}).empty());
    EXPECT_TRUE(lamps_of(scene, {.lit_elsewhere = true}).empty());
    scene.environment.color = vec3(1);
    EXPECT_EQ(lamps_of(scene).size(), lamps.size()) << "no environment enters either";
    scene.environment.color = vec3(0);
    scene.cameras = {look_at_camera({0, 0, 9}, {0, 0, 0}, {0, 1, 0}, 1)};
    EXPECT_TRUE(needs_sky(scene)) << "the room is seen from outside";
    EXPECT_FALSE(lamps_of(scene, {.camera = closed_room().cameras[0]}).empty()) << "--look-from is inside";
    Scene open = closed_room();
    const Mesh& walls = open.meshes[0];
    std::erase_if(open.meshes[0].triangles, [&](const uvec3& t) {
        return std::min({walls.positions[t.x].y, walls.positions[t.y].y, walls.positions[t.z].y}) > 1;
    });
    ASSERT_EQ(walls.triangles.size(), 10U);
    open.meshes[0].triangle_material.resize(10);
    EXPECT_TRUE(needs_sky(open)) << "the room has no ceiling";
}

TEST(RoomLamps, LightClosedScenesWithoutCameras) {
    Scene scene = closed_room();
    scene.cameras.clear();
    for (uvec3& triangle : scene.meshes[0].triangles) std::swap(triangle.x, triangle.y);
    for (vec3& normal : scene.meshes[0].normals) normal = -normal;
    add_box(scene, add_material(scene, diffuse_material(vec3(0.2f))), vec3(-0.3f), vec3(0.3f));
    EXPECT_FALSE(lamps_of(scene).empty());
}

TEST(SceneTables, ScenesBeyondTheirLimitsGoToPages) {
    SceneSize size;
    size.stored = std::size_t{1} << 25, size.vertex_texels = std::size_t{1} << 27;
    EXPECT_NO_THROW(check_tables(size, "large.glb"));
    SceneSize triangles = size, texels = size;
    ++triangles.stored, ++texels.vertex_texels;
    for (const SceneSize& larger : {triangles, texels}) {
        EXPECT_THROW(check_tables(larger, "large.glb"), BudgetError);
        bool paged = false;
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
    EXPECT_TRUE(message.starts_with(path.string() + ": has 80000000 triangles")) << message;
}

TEST(DefaultBounces, MoreWhereSomeMaterialIsSolid) {
    const auto bounces = [](float transmission, float thickness, float metallic) {
        return default_bounces(with_material(helmet(), 0, [&](Material& m) {
            m.transmission = transmission, m.thickness = thickness, m.metallic = metallic;
        }));
    };
    EXPECT_EQ(bounces(0, 0, 0), kBounces);
    EXPECT_EQ(bounces(1, 0, 0), kBounces) << "a thin wall";
    EXPECT_EQ(bounces(1, 0.1f, 0), kBouncesOfSolids);
    EXPECT_EQ(bounces(1, 0.1f, 1), kBounces) << "metal transmits no light";
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
    const dmat4 camera = halflight::default_camera(rays::SceneProbe(scene), 1).camera.camera_to_world;
    const dvec3 towards = -dvec3(preset_sky(SkyPreset::sky).sun->direction);
    EXPECT_GT(glm::dot(towards, dvec3(camera[0])), 0.3) << "right";
    EXPECT_GT(glm::dot(towards, dvec3(camera[2])), 0.3) << "behind";
}

TEST(Environment, Texts) {
    const auto choice = [](const std::string& text) { return parse_environment("--env", text); };
    const std::pair<const char*, EnvironmentChoice> choices[] = {{"none", vec3(0)},
                                                                 {"studio", SkyPreset::studio},
                                                                 {"neutral", SkyPreset::neutral},
                                                                 {"overcast", SkyPreset::overcast},
                                                                 {"grey", SkyPreset::overcast},
                                                                 {"./studio", std::filesystem::path("./studio")},
                                                                 {"white", vec3(1)},
                                                                 {"#fff", vec3(1)},
                                                                 {"0.1,2,3", vec3(0.1f, 2, 3)},
                                                                 {"sky.hdr", std::filesystem::path("sky.hdr")}};
    for (const auto& [text, expected] : choices) EXPECT_EQ(choice(text), expected) << text;
    EXPECT_NEAR(std::get<vec3>(choice("#808080")).g, 0.2158605f, 1e-6) << "sRGB-encoded (IEC 61966-2-1)";
    EXPECT_EQ(choice("#880000"), choice("#800"));
    EXPECT_EQ(color_of_text("grey"), color_of_text("#808080")) << "lights may have the colour";
    const ClearSky sky = parse_clear_sky("--sky", "-12.5,-90,4,0.5,2000");
    EXPECT_EQ(sky, (ClearSky{-12.5, -90, 4, 0.5, 2000}));
    EXPECT_EQ(parse_clear_sky("--sky", text(sky)), sky);
    EXPECT_EQ(parse_clear_sky("--sky", "12.5,-90").turbidity, ClearSky().turbidity);
    for (const char* text : {"", "#12345", "#ggg", "1,2,1e99"})
        EXPECT_TRUE(error_message([&] { choice(text); }).starts_with("--env: expects ")) << text;
    for (const char* text :
         {"", "45", "45,0,3,2", "a,b", "45,0,", "nan,0", "-19,0", "1,1e9", "1,0,0.9", "1,0,2,0,-1", "1,0,2,0,1,1"})
        EXPECT_TRUE(error_message([&] { parse_clear_sky("--sky", text); }).starts_with("--sky: expects ")) << text;
}

}  // namespace
}  // namespace halflight
