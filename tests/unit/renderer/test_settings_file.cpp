// Tests settings files: round trips, and messages that name the invalid element.
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>
#include <random>

#include "api/halflight/settings_file.h"
#include "tests/cli/animated_scenes.h"
#include "tests/support/error_message.h"
#include "tests/support/process.h"
#include "tests/support/scenes.h"

namespace halflight {
namespace {

SavedSettings all_kinds() {
    SavedSettings s;
    CameraPose pose;
    pose.from = {0.1, 1.0 / 3, -1e7};
    pose.at = {5, 6, 7};
    pose.vertical_fov = 0.7;
    pose.near_plane = 0.25;
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
    s.edits.lights = {{"0", {}},
                      {"1", {0.3f}},
                      {"2", {2, vec3(0.2f, 0, 1)}},
                      {"3", {1, {}, dvec3(0.1, -2e5, 3)}},
                      {"key", {1, {}, {}, dvec3(0, -0.6, 0.8)}}};
    s.edits.clay = true;
    s.edits.materials = {{"0", {{"roughness", {0.2f}}, {"base_color", {0.1f, 0.5f, 1, 1}}}}, {"12", {{"ior", {1.3f}}}}};
    s.edits.transforms[3] = dmat4(dvec4(1, 2, 3, 0), dvec4(0, 1, 0, 0), dvec4(0.1, 0, 1, 0), dvec4(4, 1.0 / 3, 6, 1));
    s.moment = {{"run", 13, {30000, 1001}}};
    pose.orthographic = true;
    pose.ortho_height = 3;
    s.bookmarks = {{"one", pose}, {"", CameraPose()}};
    return s;
}

TEST(SettingsFile, RoundTrips) {
    TemporaryFolder folder;
    SavedSettings s = all_kinds();
    for (const EnvironmentChoice& environment :
         {EnvironmentChoice(), EnvironmentChoice(vec3(0.1f, 2, 3)), EnvironmentChoice(folder / "sky.hdr"),
          EnvironmentChoice(SkyPreset::studio), EnvironmentChoice(ClearSky{12.5, -100, 1.0 / 3 + 2})}) {
        s.environment = environment;
        write_settings(folder / "a.json", s);
        const SavedSettings r = read_settings(folder / "a.json");
        EXPECT_EQ(r.camera, s.camera);
        EXPECT_EQ(r.settings.view, s.settings.view);
        EXPECT_EQ(r.size, s.size);
        EXPECT_EQ(r.given, s.given);
        EXPECT_EQ(r.settings.samples, s.settings.samples);
        EXPECT_EQ(r.settings.bounces, s.settings.bounces);
        EXPECT_EQ(r.settings.preview, s.settings.preview);
        EXPECT_EQ(r.settings.clamp, s.settings.clamp);
        EXPECT_EQ(r.variant, s.variant);
        EXPECT_EQ(r.line_width, s.line_width);
        EXPECT_EQ(r.environment, s.environment);
        EXPECT_EQ(r.edits, s.edits);
        EXPECT_EQ(r.bookmarks, s.bookmarks);
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
    TemporaryFolder folder;
    SavedSettings s;
    s.edits.materials = {{"floor", {{"roughness", {0.3f}}}}};
    write_settings(folder / "a.json", s);
    EXPECT_NE(test::read_text(folder / "a.json").find("\"roughness\": 0.3\n"), std::string::npos);
    std::mt19937 random(5);
    s.edits.materials.clear();
    while (s.edits.materials.size() < 20000) {
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
    TemporaryFolder folder;
    test::write_text(folder / "a.json", "old");
    SavedSettings s;
    s.environment = folder / "\xff.hdr";
    const std::string message = error_message([&] { write_settings(folder / "a.json", s); });
    EXPECT_NE(message.find("cannot be saved as a setting"), std::string::npos) << message;
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
    TemporaryFolder folder;
    const auto message = [&](const std::string& text) {
        test::write_text(folder / "a.json", text);
        std::string said = error_message([&] { read_settings(folder / "a.json"); });
        const std::string path = (folder / "a.json").string();
        EXPECT_TRUE(said.starts_with(path)) << said;
        return said.substr(std::min(path.size() + 2, said.size()));
    };
    const auto with = [&](const std::string& more) { return message("{\"halflight_settings\": 1, " + more + "}"); };
    EXPECT_EQ(message("{"), "is not valid JSON at line 1, column 2");
    EXPECT_EQ(message("{\n  \"size\": [640,]}"), "is not valid JSON at line 2, column 16");
    EXPECT_EQ(message("[1e999]"), "is not valid JSON: a number is too large");
    EXPECT_EQ(message("[]"), "is no object");
    EXPECT_EQ(message("{}"), "has no 'halflight_settings', the version of its format");
    EXPECT_EQ(message("{\"halflight_settings\": 2}"), "halflight_settings: is not 1, the version that is known");
    EXPECT_EQ(with("\"sample\": 1"), "there is no setting 'sample'; did you mean 'samples'?");
    EXPECT_EQ(with("\"samples\": 0"), "samples: is no number from 1 to 16777216");
    EXPECT_EQ(with("\"samples\": 1.5"), "samples: is no whole number");
    EXPECT_EQ(with("\"samples\": \"auto\""), "samples: is no number from 1 to 16777216");
    EXPECT_EQ(with("\"bounces\": \"many\""), "bounces: expects auto or a whole number from 0 to 1024, not 'many'");
    EXPECT_EQ(with("\"size\": [640]"), "size: is no list of two numbers");
    EXPECT_EQ(with("\"size\": [640, 65537]"), "size[1]: is no number from 1 to 65536");
    EXPECT_EQ(with("\"preview\": \"cache,blur\""),
              "preview: cache,blur: 'blur' is no preview mode; there are: cache, temporal, filter");
    EXPECT_EQ(with("\"clamp\": -1"), "clamp: is no number from 0 to 1e+30");
    EXPECT_EQ(with("\"clay\": 1"), "clay: is neither true nor false");
    EXPECT_EQ(with("\"lights\": [1, -1]"), "lights[1]: is no number from 0 to 1000000000");
    EXPECT_EQ(with("\"lights\": [{\"factor\": 1, \"colour\": 1}]"),
              "lights[0]: there is no setting 'colour'; did you mean 'color'?");
    EXPECT_EQ(with("\"lights\": [{\"color\": [0, 0, 2]}]"), "lights[0].color[2]: is no number from 0 to 1");
    EXPECT_EQ(with(R"("transforms": {"1st": []})"), "transforms: '1st' is no index");
    EXPECT_EQ(with(R"("materials": [{}])"), "materials: is no object");
    EXPECT_EQ(with(R"("materials": {"1": {"rough": 1}})"), "materials.1: materials have no property 'rough'");
    EXPECT_EQ(with(R"("materials": {"1": {"roughness": 2}})"), "materials.1: roughness: 2 is outside [0, 1]");
    EXPECT_EQ(with(R"("materials": {"1": {"emission": [1]}})"), "materials.1: emission takes 3 numbers, not 1");
    EXPECT_EQ(with(R"("transforms": {"0": [1, 2, 3]})"), "transforms.0: has 3 numbers; 12 or 16 are expected");
    EXPECT_EQ(with(R"("transforms": {"0": [[1, 2, 3]]})"), "transforms.0: has a row that is no list of four numbers");
    EXPECT_EQ(with(R"("transforms": {"0": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 1, 1]]})"),
              "transforms.0: is not affine");
    EXPECT_EQ(with("\"animation\": {\"frame\": 1}"), "animation: needs a name");
    EXPECT_EQ(with("\"animation\": {\"name\": \"a\", \"frame\": -1}"),
              "animation.frame: is no number from 0 to 4294967295");
    EXPECT_EQ(with("\"lights\": [{\"direction\": [0, 0, 0]}]"), "lights[0].direction: is no direction");
    EXPECT_EQ(with("\"environment\": {\"tint\": [0, -1, 0]}"), "environment.tint[1]: is no number from 0 to 1");
    EXPECT_EQ(with("\"camera\": {\"from\": [0, 1]}"), "camera.from: is no list of three numbers");
    EXPECT_EQ(with("\"camera\": {\"fov\": 40}"), "camera: there is no setting 'fov'");
    EXPECT_EQ(with("\"camera\": {\"from\": [0, 0, 0]}"), "camera: from and at are the same point");
    EXPECT_EQ(with("\"camera\": {\"from\": [0, 0, 1], \"near\": 2, \"far\": 1}"), "camera: far must be beyond near");
    EXPECT_EQ(with("\"environment\": {\"map\": \"a\", \"color\": [1, 1, 1]}"),
              "environment: has both 'map' and 'color'");
    EXPECT_EQ(with(R"("environment": {"preset": "night"})"), "environment.preset: is none of studio, sky, overcast");
    EXPECT_EQ(with(R"("environment": {"sky": {"sun": 1}})"), "environment.sky: there is no setting 'sun'");
    EXPECT_EQ(with(R"("environment": {"sky": {"turbidity": 1}})"),
              "environment.sky.turbidity: is no number from 2 to 10");
    for (const char* none : {"", "\\u0000", "/\\u0000sky.hdr"})
        EXPECT_EQ(with(fmt::format("\"environment\": {{\"map\": \"{}\"}}", none)),
                  "environment.map: is no name of a file");
    EXPECT_EQ(with("\"bookmarks\": [{\"name\": \"a\"}]"), "bookmarks[0]: needs a name and a camera");
    EXPECT_EQ(error_message([&] { read_settings(folder / "no.json"); }).find((folder / "no.json").string()), 0u);
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
    const auto message = [&](const SceneEdits& edits) { return error_message([&] { apply(edits, scene); }); };
    constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
    EXPECT_EQ(message({.environment_rotation = 2e6}),
              "box: rotation of the environment: 2000000 is outside [-1000000, 1000000]");
    EXPECT_EQ(message({.environment_intensity = -1}),
              "box: intensity of the environment: -1 is outside [0, 1000000000]");
    EXPECT_EQ(message({.environment_tint = {0, 2, 0}}), "box: tint of the environment: 2 is outside [0, 1]");
    EXPECT_EQ(message({.emission = kNan}), "box: factor of emission: nan is outside [0, 1000000000]");
    EXPECT_EQ(message({.lights = {{"1", {-1}}}}), "box: light 1: factor: -1 is outside [0, 1000000000]");
    EXPECT_EQ(message({.lights = {{"0", {1, vec3(0, 0, -1)}}}}), "box: light 0: color: -1 is outside [0, 1]");
    EXPECT_EQ(message({.lights = {{"0", {1, {}, dvec3(kNan)}}}}),
              "box: light 0: position: nan is outside [-1000000000000, 1000000000000]");
    EXPECT_EQ(message({.lights = {{"0", {1, {}, {}, dvec3(0)}}}}), "box: light 0: direction: is not of unit length");
    EXPECT_EQ(message({.transforms = {{0, dmat4(kNan)}}}),
              "box: instance 0: its transform is not finite, or not affine");
    EXPECT_EQ(message({.materials = {{"0", {{"roughness", {2}}}}}}), "box: material 0: roughness: 2 is outside [0, 1]");
    EXPECT_EQ(message({.lights = {{"0", {2, vec3(1), dvec3(1e12), dvec3(0, 0, 1)}}}}), "");
    EXPECT_EQ(message({.lights = {{"2", {}}}}), "box: there is no light 2; the scene has 2, numbered from 0");
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
