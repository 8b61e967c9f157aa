// Tests light groups by name: which lights they have, their texts, and the names of their layers.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include "api/halflight/aov_names.h"
#include "api/halflight/edit_text.h"
#include "api/halflight/settings_file.h"
#include "api/light_groups.h"
#include "engine/settings/layers.h"
#include "tests/support/error_message.h"

namespace halflight {
namespace {

/// A lamp and a screen below a node, another lamp and a floor beside them, and a sky.
struct Stage {
    Scene scene;
    SceneTree tree;
    Stage() {
        scene.name = "stage";
        scene.meshes.resize(2);
        scene.materials.resize(2);
        scene.materials[0].name = "glow";
        scene.materials[0].emission = vec3(2);
        scene.materials[1].name = "wood";
        tree.nodes = {{"rig", kNone}, {"lamp a", 0}, {"screen", 0}, {"lamp b", kNone}, {"floor", kNone}};
        tree.light_nodes = {1, 3};
        scene.instances = {{"screen", 0, dmat4(1), 2}, {"floor", 1, dmat4(1), 4}};
        scene.lights.resize(2);
        scene.lights[0].name = "lamp a";
        scene.lights[1].name = "lamp b";
        scene.environment.color = vec3(1);
    }
    Scene with(std::initializer_list<const char*> groups) const {
        SceneEdits edits;
        for (const char* group : groups) add_light_group(edits, "--light-group", group);
        Scene edited = scene;
        apply(edits, edited, tree);
        return edited;
    }
    std::string message(std::initializer_list<const char*> groups) const {
        return error_message([&] { with(groups); });
    }
};

using Names = std::vector<std::string>;

TEST(LightGroupNames, FindLightsMaterialsNodesAndTheEnvironment) {
    const Stage stage;
    const Scene s = stage.with({"key=lamp*", "panel=material:glow", "sky=environment"});
    EXPECT_EQ(s.light_groups, (Names{"key", "panel", "sky", "rest"}));
    EXPECT_EQ(s.lights[0].light_group, 0u);
    EXPECT_EQ(s.lights[1].light_group, 0u);
    EXPECT_EQ(s.materials[0].light_group, 1u);
    EXPECT_EQ(s.materials[1].light_group, kNoLightGroup);
    EXPECT_EQ(s.environment.light_group, 2u);
    // A node has everything below it. The first group that names a light has it.
    const Scene rig = stage.with({"one=light:1", "rig=rig", "all=lamp*", "one=light:0"});
    EXPECT_EQ(rig.light_groups, (Names{"one", "rig", "all", "rest"}));
    EXPECT_EQ(rig.lights[0].light_group, 0u);
    EXPECT_EQ(rig.lights[1].light_group, 0u);
    EXPECT_EQ(rig.instances[0].light_group, 1u);
    EXPECT_EQ(rig.instances[1].light_group, kNoLightGroup);
    EXPECT_TRUE(stage.with({}).light_groups.empty());
}

TEST(LightGroupNames, OfEachLightAreTheirOwn) {
    Stage stage;
    stage.scene.lights[1].name = "lamp.a";
    stage.scene.lights.push_back(stage.scene.lights[1]);
    stage.scene.lights.back().name = "lamp=a";
    const Scene s = stage.with({"each"});
    EXPECT_EQ(s.light_groups, (Names{"lamp_a", "lamp_a_2", "lamp_a_3", "glow", "environment", "rest"}));
    EXPECT_EQ(s.lights[2].light_group, 2u);
    EXPECT_EQ(s.materials[0].light_group, 3u);
    EXPECT_EQ(s.environment.light_group, 4u);
    stage.scene.lights.resize(30);
    EXPECT_EQ(stage.message({"each"}), "stage: makes 33 light groups, with 'rest'; at most 32 are possible");
    const std::string both =
        "--light-group: 'each' makes a group of every light, and cannot be given with named groups";
    EXPECT_EQ(stage.message({"each", "key=lamp a"}), both);
    EXPECT_EQ(stage.message({"key=lamp a", "each"}), both);
}

TEST(LightGroupNames, OfTheEnvironmentAndOfOtherLightsAreReserved) {
    Stage stage;
    stage.scene.lights[0].name = "rest";
    stage.scene.materials[0].name = "environment";
    EXPECT_EQ(stage.with({"each"}).light_groups, (Names{"rest_2", "lamp_b", "environment_2", "environment", "rest"}));
}

TEST(LightGroupNames, OfEachLightIncludeLightsOfOtherPoses) {
    Stage stage;
    const SeparateLights lights = separate_lights(stage.scene, {1}, "stage");
    EXPECT_EQ(lights.names, (Names{"lamp_a", "lamp_b", "glow", "wood", "environment", "rest"}));
    stage.scene.materials[0].emission = vec3(0);
    set_light_groups(lights, stage.scene);
    EXPECT_EQ(stage.scene.light_groups, lights.names);
    EXPECT_EQ(stage.scene.materials[0].light_group, 2u);
    EXPECT_EQ(stage.scene.environment.light_group, 4u);
}

TEST(LightGroupNames, WithoutLightAreKnown) {
    Stage stage;
    stage.scene.meshes[0].triangle_material = {0};
    stage.scene.meshes[1].triangle_material = {1};
    const Scene s = stage.with({"wood=material:wood", "all=*", "again=lamp a", "sky=environment"});
    EXPECT_EQ(dark_light_groups(s, {}), (Names{"wood", "again"}));
    EXPECT_EQ(dark_light_groups(s, {1}), Names{"again"});
    EXPECT_EQ(dark_light_groups(stage.with({"rig=rig", "floor=node:floor"}), {}), Names{"floor"});
}

TEST(LightGroupNames, MistakesAreNamed) {
    const Stage stage;
    EXPECT_EQ(stage.message({"key=lamp c"}),
              "--light-group: stage: there is no light, material or node 'lamp c'; did you mean 'lamp a'?");
    EXPECT_EQ(stage.message({"key=light:lamp c"}),
              "--light-group: stage: there is no light 'lamp c'; did you mean 'lamp a'?");
    EXPECT_EQ(stage.message({"key=z*"}), "--light-group: stage: no light, material or node matches 'z*'");
    EXPECT_EQ(stage.message({"key=0"}), "--light-group: stage: '0' needs a kind: light:0, material:0 or node:0");
    EXPECT_EQ(stage.message({"rest=lamp*"}),
              "--light-group: stage: 'rest' is the group of all lights that no other group names");
    EXPECT_EQ(stage.message({"a.b=lamp*"}),
              "--light-group: stage: 'a.b' cannot name a light group: names have letters, "
              "digits, _ and -");
    for (const char* text : {"key", "key=", "key=a,,b", ""})
        EXPECT_EQ(stage.message({text}), fmt::format("--light-group: expects NAME=LIGHT,... or each, not '{}'", text));
}

TEST(LightGroupNames, SettingsFilesHoldThem) {
    SavedSettings s;
    for (const char* group : {"key=lamp*,environment", "panel=glow"}) add_light_group(s.edits, "", group);
    const std::string text = settings_text(s, "");
    EXPECT_EQ(parse_settings(text, "file").edits, s.edits) << text;
    EXPECT_EQ(parse_settings(text, "file").edits.light_groups[0].source, "file: light_groups");
    EXPECT_EQ(error_message([&] { add_light_group(s.edits, "--light-group", "each"); }),
              "--light-group: 'each' makes a group of every light, and cannot be given with named groups");
    s.edits.light_groups.clear();
    add_light_group(s.edits, "", "each");
    EXPECT_THROW(add_light_group(s.edits, "", "key=lamp"), Error);
    EXPECT_TRUE(parse_settings(settings_text(s, ""), "file").edits.each_light);
    const auto refused = [](const char* value) {
        return error_message(
            [&] { parse_settings(fmt::format(R"({{"halflight_settings": 1, "light_groups": {}}})", value), "file"); });
    };
    EXPECT_EQ(refused("\"all\""), "file: light_groups: is neither an object nor \"each\"");
    EXPECT_NE(refused("{\"key\": 3}"), "");
}

TEST(LightGroupNames, NameLayers) {
    const AovInfo* const layer = find_aov("light_key");
    ASSERT_NE(layer, nullptr);
    EXPECT_EQ(layer, find_aov("light_key"));
    EXPECT_EQ(layer->channel_names(), (Names{"light_key.R", "light_key.G", "light_key.B"}));
    EXPECT_TRUE(layer->is_color() && layer->is_light_group() && !layer->at_any_time());
    EXPECT_EQ(find_aov("light_"), nullptr);
    EXPECT_EQ(renamed(AovNames::blender, "light_key", layer->channel_names()),
              (Names{"ViewLayer.Combined_key.R", "ViewLayer.Combined_key.G", "ViewLayer.Combined_key.B"}));
    EXPECT_EQ(renamed(AovNames::arnold, "light_a-b", {"light_a-b.R"}), Names{"RGBA_a-b.R"});
}

}  // namespace
}  // namespace halflight
