// Tests light groups by name: which lights they have, their texts, and the names of their layers.
#include <gtest/gtest.h>

#include "api/halflight/aov_names.h"
#include "api/halflight/edit_text.h"
#include "api/halflight/settings_file.h"
#include "api/scene/light_groups.h"
#include "engine/settings/layers.h"
#include "tests/unit/renderer/refusal.h"

namespace halflight {
namespace {

/// A lamp and a screen below a node, another lamp and a floor beside them, and a sky.
struct Stage {
    Scene scene;
    SceneTree tree;
    Stage() {
        scene.name = "stage";
        scene.meshes.resize(2);
        for (const char* name : {"glow", "wood"}) scene.materials.emplace_back().name = name;
        scene.materials[0].emission = vec3(2);
        tree.nodes = {{"rig", kNone}, {"lamp a", 0}, {"screen", 0}, {"lamp b", kNone}, {"floor", kNone}};
        tree.light_nodes = {1, 3};
        scene.instances = {{"screen", 0, dmat4(1), 2}, {"floor", 1, dmat4(1), 4}};
        for (const char* name : {"lamp a", "lamp b"}) scene.lights.emplace_back().name = name;
        scene.environment.color = vec3(1);
    }
    Scene with(std::initializer_list<const char*> groups) const {
        SceneEdits edits;
        for (const char* group : groups) add_light_group(edits, "--light-group", group);
        Scene edited = scene;
        apply(edits, edited, tree);
        return edited;
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
    stage.scene.lights.resize(29);
    EXPECT_EQ(stage.with({"each"}).light_groups.size(), 32u);
    stage.scene.lights.resize(30);
    expect_refusal([&] { stage.with({"each"}); }, "stage: makes 33 light groups");
}

TEST(LightGroupNames, AreShortEnoughForChannels) {
    Stage stage;
    std::string name;
    while (name.size() < 300) name += "\u00e9";  // two bytes
    stage.scene.lights[0].name = name + "a";
    stage.scene.lights[1].name = "x" + name + "b";
    stage.scene.lights.push_back(stage.scene.lights[0]);
    stage.scene.lights.back().name = name + "c";
    const Names groups = stage.with({"each"}).light_groups;
    EXPECT_EQ(groups[0], name.substr(0, 200));
    EXPECT_EQ(groups[1], "x" + name.substr(0, 198)) << "no half of a character";
    EXPECT_EQ(groups[2], name.substr(0, 200) + "_2");
    for (const AovNames names : {AovNames::halflight, AovNames::blender, AovNames::arnold})
        EXPECT_LE(renamed(names, "light_" + groups[2], {"R"})[0].size() + std::string_view(".right").size(), 255u);
    const std::string longer = std::string(201, 'a') + "=lamp a";
    expect_refusal([&] { stage.with({longer.c_str()}); }, "at most 200 bytes", "--light-group: ");
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
    const std::pair<const char*, const char*> refusals[] = {
        {"key=lamp c", "stage: there is no light, material or node"},
        {"key=light:lamp c", "stage: there is no light 'lamp c'"},
        {"key=z*", "stage: no light, material or node matches 'z*'"},
        {"key=0", "stage: '0' needs a kind"},
        {"rest=lamp*", "'rest'"},
        {"a.b=lamp*", "'a.b'"},
        {"key", "not 'key'"},
        {"key=", "not 'key='"},
        {"key=a,,b", "not 'key=a,,b'"},
        {"", "not ''"}};
    for (const auto& [text, element] : refusals)
        expect_refusal([&] { stage.with({text}); }, element, "--light-group: ");
    expect_refusal([&] { stage.with({"each", "key=lamp a"}); }, "'each'", "--light-group: ");
    expect_refusal([&] { stage.with({"key=lamp a", "each"}); }, "'each'", "--light-group: ");
}

TEST(LightGroupNames, SettingsFilesHoldThem) {
    SavedSettings s;
    for (const char* group : {"key=lamp*,environment", "panel=glow"}) add_light_group(s.edits, "", group);
    const std::string text = settings_text(s, "");
    EXPECT_EQ(parse_settings(text, "file").edits, s.edits) << text;
    EXPECT_EQ(parse_settings(text, "file").edits.light_groups[0].source, "file: light_groups");
    s.edits.light_groups.clear();
    add_light_group(s.edits, "", "each");
    EXPECT_TRUE(parse_settings(settings_text(s, ""), "file").edits.each_light);
}

TEST(LightGroupNames, NameLayers) {
    const AovInfo* const layer = find_aov("light_key");
    ASSERT_NE(layer, nullptr);
    EXPECT_EQ(layer->channel_names(), (Names{"light_key.R", "light_key.G", "light_key.B"}));
    EXPECT_TRUE(layer->is_color() && layer->is_light_group() && !layer->at_any_time());
    EXPECT_EQ(find_aov("light_"), nullptr);
    EXPECT_EQ(renamed(AovNames::blender, "light_key", layer->channel_names()),
              (Names{"ViewLayer.Combined_key.R", "ViewLayer.Combined_key.G", "ViewLayer.Combined_key.B"}));
    EXPECT_EQ(renamed(AovNames::arnold, "light_a-b", {"light_a-b.R"}), Names{"RGBA_a-b.R"});
}

}  // namespace
}  // namespace halflight
