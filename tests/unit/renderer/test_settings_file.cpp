// Tests settings files: round trips, and messages that name the invalid element.
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>
#include <random>

#include "api/halflight/edit_text.h"
#include "api/halflight/settings_file.h"
#include "engine/core/names.h"
#include "tests/cli/animated_scenes.h"
#include "tests/support/process.h"
#include "tests/support/scenes.h"
#include "tests/unit/renderer/refusal.h"

namespace halflight {
namespace {

SavedSettings all_kinds() {
    SavedSettings s;
    CameraPose pose;
    pose.from = {0.1, 1.0 / 3, -1e7};
    pose.at = {5, 6, 7};
    pose.vertical_fov = 0.7;
    pose.near_plane = 0.25, pose.far_plane = 1e3;
    s.camera = pose;
    s.settings.view = {"sRGB", "Raw", "a look", 1.3f};
    s.size = ivec2(640, 48);
    s.settings.samples = 77;
    s.settings.bounces = 3;
    s.settings.preview = {.cache = true, .filter = true};
    s.settings.clamp = 0.3f;
    s.given = saved_settings();
    s.variant = "red 'velvet'";
    s.line_width = 0.025;
    s.edits.environment_rotation = 12.5;
    s.edits.environment_intensity = 0.1f;
    s.edits.emission = 2;
    s.edits.environment_tint = {1, 0.5f, 0.1f};
    s.edits.lights = {
        {"0", {}},
        {"1", {0.3f}},
        {"2", {2, vec3(0.2f, 0, 1)}},
        {"3", {1, {}, dvec3(0.1, -2e5, 3)}},
        {"key", {1, {}, {}, dvec3(0, -0.6, 0.8)}},
        {"a = b", {.intensity = 1.0f / 3, .temperature = 2700.5f, .radius = 0.1f, .angle = 0.53f, .off = true}},
        {"desk", {.ies = "/lamps/a, b = c.ies"}}};
    s.edits.nodes = {{"n", {{0.1, 1.0 / 3, 0}, {45, 0, -1e-5}, {1, 2, 1.0 / 7}}}};
    s.edits.nodes[0].edit.matrix =
        dmat4(dvec4(0.1, 0, 0, 0), dvec4(0, 0.7, 0.2, 0), dvec4(0, 0, 1, 0), dvec4(4, 5, 6, 1));
    s.edits.hidden = {{"mesh:crate"}};
    s.edits.catchers = {{"floor"}};
    s.edits.clay = true;
    s.edits.ground = true, s.edits.ground_height = -1.0 / 3;
    s.edits.lamp_radius = 0.05f, s.edits.sun_angle = 0.53f;
    s.edits.straight_glass = true;
    s.light_azimuth = 1.0 / 3 - 40;
    s.edits.materials = {{"0", {{"roughness", {0.2f}}, {"base_color", {0.1f, 0.5f, 1, 1}}}}, {"12", {{"ior", {1.3f}}}}};
    s.edits.transforms[3] = dmat4(dvec4(1, 2, 3, 0), dvec4(0, 1, 0, 0), dvec4(0.1, 0, 1, 0), dvec4(4, 1.0 / 3, 6, 1));
    using Of = EditTrack::Of;
    s.keys.tracks = {{.of = Of::scene, .key = "emission", .keys = {{-1, "0.5"}, {2.5, "1"}}},
                     {.of = Of::environment, .key = "tint", .keys = {{1, "1,0.5,0"}}},
                     {.of = Of::camera, .key = "camera", .keys = {{1, "nave"}, {9, "2nd, of two"}}},
                     {.of = Of::camera, .key = "from", .keys = {{1, "0.1,2,3"}, {2, "4,5,6"}}, .step = true},
                     {.of = Of::lights, .name = "a.b", .key = "off", .keys = {{1, "true"}, {12, "false"}}},
                     {.of = Of::materials, .name = "*", .key = "base_color", .keys = {{1, "1,0.5,0.25"}}},
                     {.of = Of::nodes, .name = "n", .key = "scale", .keys = {{1, "1,1,1"}, {24, "2,2,2"}}},
                     {.of = Of::hide, .name = "mesh:n", .keys = {{1, "false"}, {2, "true"}}}};
    s.moment = {{"run", 13, {30000, 1001}}};
    pose.orthographic = true;
    pose.ortho_height = 3;
    s.bookmarks = {{"one", pose}, {"", CameraPose()}};
    return s;
}

TEST(SettingsFile, RoundTrips) {
    TemporaryFolder folder;
    SavedSettings s = all_kinds();
    s.edits.lights.back().edit.ies = (folder / "a, b = c.ies").string();
    for (const EnvironmentChoice& environment :
         {EnvironmentChoice(), EnvironmentChoice(vec3(0.1f, 2, 3)), EnvironmentChoice(folder / "sky.hdr"),
          EnvironmentChoice(SkyPreset::studio), EnvironmentChoice(SkyPreset::neutral),
          EnvironmentChoice(ClearSky{-12.5, -100, 1.0 / 3 + 2, 1.0 / 3, 1234.5})}) {
        s.environment = environment;
        write_settings(folder / "a.json", s);
        const SavedSettings r = read_settings(folder / "a.json");
        EXPECT_TRUE(r == s) << test::read_text(folder / "a.json");
        EXPECT_EQ(r.settings.view, s.settings.view);
        EXPECT_EQ(r.settings.clamp, s.settings.clamp);
    }
    EXPECT_EQ(folder.entries(), std::vector<std::string>{"a.json"}) << "no temporary file stays";
    s.settings.bounces.reset();
    s.given.insert("bounces");
    s.camera = std::string("nave");
    write_settings(folder / "a.json", s);
    EXPECT_EQ(read_settings(folder / "a.json").camera, s.camera);
    EXPECT_EQ(read_settings(folder / "a.json").settings.bounces, std::nullopt) << "auto";
}

TEST(SettingsFile, NumbersAreShortAndExact) {
    const TemporaryFolder folder;
    SavedSettings s;
    s.edits.materials = {{"floor", {{"roughness", {0.3f}}}}};
    EXPECT_NE(settings_text(s, "").find("\"roughness\": 0.3\n"), std::string::npos);
    std::mt19937 random(5);
    s.edits.materials.clear();
    while (s.edits.materials.size() < 5000) {
        const auto value =
            std::bit_cast<float>(static_cast<std::uint32_t>(random()) % std::bit_cast<std::uint32_t>(1.0f));
        s.edits.materials.push_back({std::to_string(s.edits.materials.size()), {{"roughness", {value}}}});
    }
    write_settings(folder / "a.json", s);
    EXPECT_TRUE(read_settings(folder / "a.json").edits == s.edits);
}

TEST(SettingsFile, MatricesHaveRowsOrNumbers) {
    const auto matrix = [](const char* text) {
        const std::string file = fmt::format(R"({{"halflight_settings": 1, "transforms": {{"0": {}}}}})", text);
        return parse_settings(file, "file").edits.transforms.at(0);
    };
    const dmat4 rows = matrix("[[2, 0, 0, 5], [0, 3, 0, 6], [0, 0, 4, 7], [0, 0, 0, 1]]");
    EXPECT_EQ(rows, dmat4(dvec4(2, 0, 0, 0), dvec4(0, 3, 0, 0), dvec4(0, 0, 4, 0), dvec4(5, 6, 7, 1)));
    EXPECT_EQ(matrix("[2, 0, 0, 5, 0, 3, 0, 6, 0, 0, 4, 7]"), rows);
    EXPECT_EQ(matrix("[2, 0, 0, 5, 0, 3, 0, 6, 0, 0, 4, 7, 0, 0, 0, 1]"), rows);
    EXPECT_EQ(matrix("[[2, 0, 0, 5], [0, 3, 0, 6], [0, 0, 4, 7]]"), rows);
}

TEST(SettingsFile, MapsMoveWithTheirFolder) {
    TemporaryFolder first, second;
    SavedSettings s;
    s.environment = first / "sky.hdr";
    write_settings(first / "a.json", s);
    std::filesystem::copy_file(first / "a.json", second / "a.json");
    EXPECT_EQ(read_settings(second / "a.json").environment, EnvironmentChoice(second / "sky.hdr"));
}

TEST(SettingsFile, NamesOfMapsMustBeUtf8) {
    const TemporaryFolder folder;
    test::write_text(folder / "a.json", "old");
    SavedSettings s;
    s.environment = folder / "\xff.hdr";
    expect_refusal([&] { write_settings(folder / "a.json", s); }, "cannot be saved as a setting");
    EXPECT_EQ(test::read_text(folder / "a.json"), "old");
}

TEST(SettingsFile, MapsAreFoundThroughLinks) {
    TemporaryFolder folder;
    std::filesystem::create_directories(folder / "a/b/c");
    std::filesystem::create_directory_symlink("a/b/c", folder / "link");
    test::write_text(folder / "a/b/env.exr", "");
    SavedSettings s;
    s.environment = folder / "a/b/env.exr";
    write_settings(folder / "link/a.json", s);
    for (const char* name : {"link/a.json", "a/b/c/a.json"}) {
        const auto read = std::get<std::filesystem::path>(read_settings(folder / name).environment);
        std::error_code none;
        EXPECT_TRUE(std::filesystem::equivalent(read, folder / "a/b/env.exr", none)) << read;
    }
}

TEST(SettingsFile, InvalidElementsAreNamed) {
    const TemporaryFolder folder;
    const auto refuse = [&](const std::string& text, const std::string& element) {
        test::write_text(folder / "a.json", text);
        const std::string path = (folder / "a.json").string() + ": ";
        expect_refusal([&] { read_settings(folder / "a.json"); }, path + element, path);
    };
    refuse("{", "is not valid JSON at line 1, column 2");
    refuse("{\n  \"size\": [640,]}", "is not valid JSON at line 2, column 16");
    refuse("[1e999]", "is not valid JSON");
    refuse("[]", "is no object");
    refuse("{}", "has no 'halflight_settings'");
    refuse("{\"halflight_settings\": 2}", "halflight_settings: ");
    const std::pair<const char*, const char*> members[] = {
        {R"("sample": 1)", "there is no setting 'sample'"},
        {R"("samples": 0)", "samples: "},
        {R"("samples": 1.5)", "samples: "},
        {R"("samples": "auto")", "samples: "},
        {R"("bounces": "many")", "bounces: "},
        {R"("size": [640])", "size: "},
        {R"("size": [640, 65537])", "size[1]: "},
        {R"("preview": "cache,blur")", "preview: "},
        {R"("preview": "cache", "denoise": true)", "denoise: "},
        {R"("clamp": -1)", "clamp: "},
        {R"("clay": 1)", "clay: "},
        {R"("hide": [1])", "hide[0]: "},
        {R"("nodes": {"crate": {"turn": 1}})", "nodes.crate: there is no setting 'turn'"},
        {R"("nodes": {"crate": {"rotate": 1}})", "nodes.crate.rotate: "},
        {R"("light_groups": "all")", "light_groups: "},
        {R"("light_groups": {"key": 3})", "light_groups"},
        {R"("lights": [1, -1])", "lights[1]: "},
        {R"("lights": [{"factor": 1, "colour": 1}])", "lights[0]: there is no setting 'colour'"},
        {R"("lights": [{"color": [0, 0, 2]}])", "lights[0].color[2]: "},
        {R"("lights": [{"direction": [0, 0, 0]}])", "lights[0].direction: "},
        {R"("lights": {"key": {"color": [1, 1, 1], "temperature": 2700}})", "lights.key: "},
        {R"("lights": {"key": {"radius": -1}})", "lights.key.radius"},
        {R"("lights": {"key": {"angle": 180}})", "lights.key.angle"},
        {R"("materials": [{}])", "materials: "},
        {R"("materials": {"1": {"rough": 1}})", "materials.1: materials have no property 'rough'"},
        {R"("materials": {"1": {"roughness": 2}})", "materials.1: roughness: "},
        {R"("materials": {"1": {"emission": [1]}})", "materials.1: emission "},
        {R"("transforms": {"1st": []})", "transforms: '1st'"},
        {R"("transforms": {"0": [1, 2, 3]})", "transforms.0: has 3 numbers"},
        {R"("transforms": {"0": [[1, 2, 3]]})", "transforms.0: has a row"},
        {R"("transforms": {"0": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 1, 1]]})", "transforms.0: "},
        {R"("animation": {"frame": 1})", "animation: "},
        {R"("animation": {"name": "a", "frame": -1e12})", "animation.frame: "},
        {R"("camera": {"from": [0, 1]})", "camera.from: "},
        {R"("camera": {"fov": 40})", "camera: there is no setting 'fov'"},
        {R"("camera": {"from": [0, 0, 0]})", "camera: from and at"},
        {R"("camera": {"from": [0, 0, 1], "near": 2, "far": 1})", "camera: far"},
        {R"("environment": {"tint": [0, -1, 0]})", "environment.tint[1]: "},
        {R"("environment": {"map": "a", "color": [1, 1, 1]})", "environment: has both"},
        {R"("environment": {"preset": "night"})", "environment.preset: "},
        {R"("environment": {"sky": {"sun": 1}})", "environment.sky: there is no setting 'sun'"},
        {R"("environment": {"sky": {"turbidity": 0.5}})", "environment.sky.turbidity: "},
        {R"("environment": {"map": ""})", "environment.map: "},
        {R"("environment": {"map": "\u0000"})", "environment.map: "},
        {R"("environment": {"map": "/\u0000sky.hdr"})", "environment.map: "},
        {R"("bookmarks": [{"name": "a"}])", "bookmarks[0]: "},
        {R"("keys": {"light": {}})", "keys: there is no setting 'light'"},
        {R"("keys": {"emission": 2})", "keys.emission: is no object"},
        {R"("keys": {"emission": {}})", "keys.emission: has no frame"},
        {R"("keys": {"emission": {"first": 2}})", "keys.emission: 'first' is no frame"},
        {R"("keys": {"emission": {"1": -1}})", "keys.emission.1: expects numbers from 0"},
        {R"("keys": {"lights": {"key": {"intensity": {"24": 1, "1": 2}}}})",
         "keys.lights.key.intensity: frame 1 comes after frame 24"},
        {R"("keys": {"lights": {"key": {"bright": {"1": 2}}}})", "keys.lights.key.bright.1: 'bright' is none of"},
        {R"("keys": {"lights": {"key": {"ies": {"1": "a.ies"}}}})", "keys.lights.key.ies.1: 'ies' has no keys"},
        {R"("keys": {"lights": {"key": {"off": {"1": 1}}}})", "keys.lights.key.off.1: is neither true nor false"},
        {R"("keys": {"materials": {"a": {"base_color": {"1": "red", "2": [0, 0, 0, 1]}}}})",
         "keys.materials.a.base_color: frame 2 has another count"},
        {R"("keys": {"nodes": {"a": {"rotate": {"1": 90}}}})", "keys.nodes.a.rotate.1: "},
        {R"("keys": {"camera": {"zoom": {"1": 90}}})", "keys.camera.zoom.1: 'zoom' is none of"},
        {R"("keys": {"hide": {"a": {"1": 90}}})", "keys.hide.a.1: is neither true nor false"}};
    for (const auto& [member, element] : members)
        refuse(fmt::format("{{\"halflight_settings\": 1, {}}}", member), element);
    expect_refusal([&] { read_settings(folder / "no.json"); }, (folder / "no.json").string());
}

TEST(SceneEdits, RotateTheEnvironmentByWholeTexels) {
    Scene scene;
    scene.environment = {"map", vec3(1), Image(4, 2, 3)};
    for (int i = 0; i < 24; ++i) scene.environment.map.pixels[std::size_t(i)] = float(i);
    const Scene before = scene;
    SceneEdits edits;
    edits.environment_rotation = 90;
    edits.environment_intensity = 0.5f;
    apply(edits, scene);
    EXPECT_EQ(scene.environment.color, vec3(0.5f));
    for (int y = 0; y < 2; ++y)
        for (int x = 0; x < 4; ++x)
            EXPECT_EQ(*scene.environment.map.at((x + 1) % 4, y), *before.environment.map.at(x, y)) << x << " " << y;
    for (const double none : {0.0, 360.0, -720.0, 20.0}) {
        Scene same = before;
        apply({.environment_rotation = none}, same);
        EXPECT_EQ(same.environment.map.pixels, before.environment.map.pixels) << none;
    }
    Scene back = scene;
    apply({.environment_rotation = -90}, back);
    EXPECT_EQ(back.environment.map.pixels, before.environment.map.pixels);
}

TEST(SceneEdits, ColoursReplaceTheLightsOwn) {
    Scene scene;
    PunctualLight light;
    light.intensity = {0, 2, 8};
    PunctualLight off;
    off.intensity = vec3(0);
    scene.lights = {light, light, light, off};
    scene.environment = {"constant", vec3(2, 4, 6), {}};
    EXPECT_EQ(color_of(light).color, vec3(0, 0.25f, 1));
    EXPECT_EQ(color_of(light).intensity, 8);
    EXPECT_EQ(color_of(off).color, vec3(1));
    apply(
        {.environment_intensity = 0.5f,
         .environment_tint = {1, 0.5f, 0},
         .lights = {{"0", {2, vec3(1, 0.5f, 0)}}, {"1", {3}}, {"2", {1, color_of(light).color}}, {"3", {1, vec3(1)}}}},
        scene);
    EXPECT_EQ(scene.lights[0].intensity, vec3(16, 8, 0));
    EXPECT_EQ(scene.lights[1].intensity, 3.0f * light.intensity);
    EXPECT_EQ(scene.lights[2].intensity, light.intensity);
    EXPECT_EQ(scene.lights[3].intensity, vec3(0));
    EXPECT_EQ(scene.environment.color, vec3(1, 1, 0));
}

TEST(SceneEdits, LightsAreMovedAndRotated) {
    Scene scene;
    PunctualLight spot;
    spot.type = LightType::spot;
    spot.position = {1, 2, 3};
    scene.lights = {spot, spot, spot};
    apply({.lights = {{"0", {1, {}, dvec3(4, 5, 6)}}, {"1", {1, {}, {}, unit_direction({0, -1e-200, 0})}}}}, scene);
    EXPECT_EQ(scene.lights[0].position, dvec3(4, 5, 6));
    EXPECT_EQ(scene.lights[0].direction, spot.direction);
    EXPECT_EQ(scene.lights[1].position, spot.position);
    EXPECT_EQ(scene.lights[1].direction, vec3(0, -1, 0));
    EXPECT_EQ(scene.lights[2].direction, spot.direction);
}

TEST(SceneEdits, AreCheckedWhenTheyAreApplied) {
    Scene scene = test::cornell_box(test::diffuse_material(vec3(0.5f)));
    scene.name = "box";
    scene.lights.resize(2);
    constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
    const std::pair<SceneEdits, const char*> refusals[] = {
        {{.environment_rotation = 2e6}, "rotation of the environment: 2000000"},
        {{.environment_intensity = -1}, "intensity of the environment: -1"},
        {{.environment_tint = {0, 2, 0}}, "tint of the environment: 2"},
        {{.emission = kNan}, "factor of emission: nan"},
        {{.lights = {{"1", {-1}}}}, "light 1: factor: -1"},
        {{.lights = {{"0", {1, vec3(0, 0, -1)}}}}, "light 0: color: -1"},
        {{.lights = {{"0", {1, {}, dvec3(kNan)}}}}, "light 0: position: nan"},
        {{.lights = {{"0", {1, {}, {}, dvec3(0)}}}}, "light 0: direction: "},
        {{.transforms = {{0, dmat4(kNan)}}}, "instance 0: "},
        {{.materials = {{"0", {{"roughness", {2}}}}}}, "material 0: roughness: 2"},
        {{.lights = {{"2", {}}}}, "there is no light 2"}};
    for (const auto& [edits, element] : refusals) expect_refusal([&] { apply(edits, scene); }, element, "box: ");
    EXPECT_NO_THROW(apply({.lights = {{"0", {2, vec3(1), dvec3(1e12), dvec3(0, 0, 1)}}}}, scene));
}

TEST(SceneEdits, ClayKeepsLightsAndHoles) {
    Scene scene = test::cornell_box(test::metal_material(vec3(0.9f, 0.5f, 0.1f), 0.1f));
    Material leaf = test::diffuse_material(vec3(0, 1, 0));
    leaf.alpha_mode = AlphaMode::mask;
    leaf.base_color.a = 0.3f;
    test::add_material(scene, leaf);
    PunctualLight light;
    scene.lights = {light, light};
    const Scene before = scene;
    SceneEdits edits;
    edits.clay = true;
    edits.emission = 2;
    edits.lights = {{"0", {3}}};
    apply(edits, scene);
    for (std::size_t i = 0; i < scene.materials.size(); ++i) {
        const Material& m = scene.materials[i];
        EXPECT_EQ(vec3(m.base_color), vec3(0.5f));
        EXPECT_EQ(m.metallic, 0);
        EXPECT_EQ(m.roughness, 1);
        EXPECT_EQ(m.emission, 2.0f * before.materials[i].emission);
        EXPECT_EQ(m.base_color.a, before.materials[i].base_color.a);
        EXPECT_EQ(m.alpha_mode, before.materials[i].alpha_mode);
    }
    EXPECT_EQ(scene.lights[0].intensity, 3.0f * light.intensity);
    EXPECT_EQ(scene.lights[1].intensity, light.intensity);
    EXPECT_NO_THROW(validate(scene));
}

TEST(EditKeys, AreInterpolatedByWhatTheyMean) {
    using Of = EditTrack::Of;
    const auto at = [](Of of, const char* key, const char* first, const char* last, double frame, bool step = false) {
        return sample({.of = of, .key = key, .keys = {{10, first}, {20, last}}, .step = step}, frame);
    };
    EXPECT_EQ(at(Of::lights, "intensity", "800", "200", 5), "800") << "before the first key";
    EXPECT_EQ(at(Of::lights, "intensity", "800", "200", 12.5), "650");
    EXPECT_EQ(at(Of::lights, "intensity", "800", "200", 20), "200");
    EXPECT_EQ(at(Of::lights, "intensity", "800", "200", 1e9), "200") << "after the last key";
    EXPECT_EQ(at(Of::lights, "intensity", "800", "200", 19.99, true), "800");
    EXPECT_EQ(at(Of::lights, "off", "true", "false", 19.99), "true");
    EXPECT_EQ(at(Of::nodes, "rotate", "0,0,0", "0,720,0", 15), "0,360,0") << "whole turns count";
    EXPECT_EQ(at(Of::camera, "camera", "1", "2", 15), "1") << "a name may be a number";
    EXPECT_EQ(at(Of::materials, "roughness", "", "0.5", 15), "") << "the edits beside the keys hold";
    const auto numbers = [](const std::string& text) {
        std::vector<double> all;
        for (const std::string& part : split_names(text)) all.push_back(std::stod(part));
        return all;
    };
    const double half = std::sqrt(0.5);
    const auto direction = numbers(at(Of::lights, "direction", "3,0,0", "0,0,1", 15));
    EXPECT_NEAR(direction[0], half, 1e-12);
    EXPECT_NEAR(direction[2], half, 1e-12);
    // A quarter turn about +Z with a stretch of 1 to 3 along the object's X.
    const auto matrix = numbers(at(Of::nodes, "matrix", "1,0,0,0,0,1,0,0,0,0,1,0", "0,-1,0,2,3,0,0,0,0,0,1,0", 15));
    const std::vector<double> expected{2 * half, -half, 0, 1, 2 * half, half, 0, 0, 0, 0, 1, 0};
    for (std::size_t i = 0; i < 12; ++i) EXPECT_NEAR(matrix[i], expected[i], 1e-12) << i;
}

TEST(EditKeys, OfFramesGiveBackTheirEdits) {
    const SceneEdits base{.lights = {{"key", {.factor = 2}}}};
    std::vector<FrameEdits> frames;
    for (const FrameNumber frame : {1, 2, 3}) {
        FrameEdits& own = frames.emplace_back(FrameEdits{frame, base, {}});
        light_edit(own.edits, "key").intensity = float(100 * frame);
        if (frame == 2) own.edits.hidden = {{"crate"}}, own.edits.emission = 3;
        own.camera.vfov = 40.0 + double(frame);
    }
    const EditKeys keys = keys_of(frames, base, "edit()");
    for (const FrameEdits& frame : frames) {
        SceneEdits edits = base;
        apply_keys(keys, double(frame.frame), edits);
        EXPECT_TRUE(edits == frame.edits) << frame.frame;
        EXPECT_EQ(keyed_camera(keys, double(frame.frame)), frame.camera);
    }
    EXPECT_EQ(values_text(keys, base, 1, 1), values_text(keys_of({frames[0]}, base, "edit()"), base, 1, 1));
    EXPECT_NE(values_text(keys, base, 1, 1), values_text(keys, base, 2, 2));
    const SceneEdits pattern{.lights = {{"key", {.factor = 3}}, {"*", {.factor = 7}}}};
    const auto constant = [&](const char* name, const char* factor) {
        return EditKeys{{{.of = EditTrack::Of::lights, .name = name, .key = "factor", .keys = {{1, factor}}}}};
    };
    EXPECT_EQ(values_text(constant("*", "7"), pattern, 1, 1), "");
    EXPECT_NE(values_text(constant("key", "3"), pattern, 1, 1), "") << "it comes after the pattern now";
    const SceneEdits alone{.lights = {{"key", {.factor = 3}}}};
    EditKeys both = constant("*", "7");
    both.tracks.push_back(constant("key", "3").tracks[0]);
    EXPECT_NE(values_text(both, alone, 1, 1), values_text(constant("*", "7"), alone, 1, 1));
    frames[1].edits.light_links = {{"key", {"-floor"}}};
    expect_refusal([&] { keys_of(frames, base, "edit()"); }, "edit(): frame 2: only lights");
}

TEST(SceneEdits, HoldInTheLastPose) {
    const TemporaryFolder folder;
    LoadedScene scene({.scene = test::write_sliding_light(folder.path), .animation = "slide"});
    const auto expect = [&](double x, float radiance) {
        EXPECT_EQ(scene.scene().instances.at(0).object_to_world[3].x, x);
        EXPECT_EQ(scene.scene().materials.at(0).emission, vec3(radiance));
    };
    expect(-2, 1);
    scene.edit({.emission = 2});
    expect(-2, 2);
    scene.pose(1);
    expect(0, 2);
    scene.edit({.emission = 3});
    expect(0, 3);
    scene.edit({});
    expect(0, 1);
    scene.pose(0);
    expect(-2, 1);
}

}  // namespace
}  // namespace halflight
