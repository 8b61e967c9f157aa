// Tests edits by name: which objects a name finds, what nodes and lights become, and the texts of edits.
#include <gtest/gtest.h>

#include <glm/gtc/matrix_transform.hpp>

#include "api/first_picture/default_camera.h"
#include "api/halflight/camera.h"
#include "api/halflight/edit_text.h"
#include "api/halflight/object_names.h"
#include "api/halflight/settings_file.h"
#include "api/scene/added_surfaces.h"
#include "api/scene/scene_names.h"
#include "engine/io/files.h"
#include "engine/scene/black_body.h"
#include "tests/cli/animated_scenes.h"
#include "tests/support/ies_files.h"
#include "tests/support/process.h"
#include "tests/support/scenes.h"
#include "tests/unit/io/gltf_builder.h"
#include "tests/unit/renderer/refusal.h"

namespace halflight {
namespace {

/// A group at (1, 0, 0) with a box and a lamp one metre above, and a second box beside it.
struct Yard {
    Scene scene;
    SceneTree tree;
    Yard() {
        scene.name = "yard";
        for (const char* name : {"crate", "wall"}) scene.meshes.emplace_back().name = name;
        for (const char* name : {"wood", "wood", "steel.1"}) scene.materials.emplace_back().name = name;
        const auto at = [](double x, double y) { return glm::translate(dmat4(1), dvec3(x, y, 0)); };
        tree.nodes = {{"group", kNone, true, at(1, 0)},
                      {"box a", 0, true, at(2, 0)},
                      {"box b", kNone, true, at(5, 0)},
                      {"key", 0, true, at(1, 1)},
                      {"other scene", kNone, false, at(0, 0)}};
        tree.light_nodes = {3};
        scene.instances = {{"box a", 0, at(2, 0), 1}, {"box b", 1, at(5, 0), 2}};
        PunctualLight& lamp = scene.lights.emplace_back();
        lamp.name = "key";
        lamp.type = LightType::spot;
        lamp.position = {1, 1, 0};
        lamp.direction = {0, -1, 0};
        lamp.intensity = {2, 4, 8};
    }
    Scene with(const SceneEdits& edits) const {
        Scene edited = scene;
        apply(edits, edited, tree);
        return edited;
    }
};

using AddEdit = void (*)(SceneEdits&, const std::string&, const std::string&);

SceneEdits edits_of(std::initializer_list<std::pair<AddEdit, const char*>> texts) {
    SceneEdits edits;
    for (const auto& [add, text] : texts) add(edits, "--option", text);
    return edits;
}

SceneEdits edits_in_file(const std::string& json) {
    return parse_settings("{\"halflight_settings\": 1, " + json + "}", "a.json").edits;
}

TEST(ObjectNames, PatternsMatchWholeNames) {
    for (const char* pattern : {"*", "a*", "*c", "a*c", "a?c", "???", "ab*c", "*b*", "**", "abc"})
        EXPECT_TRUE(matches_pattern(pattern, "abc")) << pattern;
    for (const char* pattern : {"", "?", "ab", "b*", "a?", "a*b", "abcd", "a*d*", "????"})
        EXPECT_FALSE(matches_pattern(pattern, "abc")) << pattern;
    EXPECT_TRUE(matches_pattern("a*ab", "aaab"));
    EXPECT_TRUE(matches_pattern("", ""));
}

TEST(ObjectNames, NamesNumbersAndPatternsFindObjects) {
    const Yard yard;
    const NamedObjects nodes = nodes_of(yard.tree), materials = materials_of(yard.scene);
    using Found = std::vector<std::size_t>;
    EXPECT_EQ(find_objects(nodes, "box b", ""), Found{2});
    EXPECT_EQ(find_objects(nodes, "1", ""), Found{1});
    EXPECT_EQ(find_objects(nodes, "box ?", ""), (Found{1, 2}));
    EXPECT_EQ(find_objects(nodes, "*", ""), (Found{0, 1, 2, 3})) << "another scene's node is left out";
    for (const char* unknown : {"box c", "7", "z*"})
        expect_refusal([&] { find_objects(nodes, unknown, "yard"); }, "yard: ");
    EXPECT_TRUE(error_message([&] { find_objects(nodes, "box c", ""); }).ends_with("did you mean 'box a'?"));
    expect_refusal([&] { find_objects(materials, "wood", "yard"); }, "'wood' is the name of 2 materials");
    EXPECT_EQ(references_to(materials), (std::vector<std::string>{"0", "1", "steel.1"}));
}

TEST(NodeEdits, MoveWhatHangsBelow) {
    const Yard yard;
    const auto moved = [&](const std::vector<const char*>& texts) {
        SceneEdits edits;
        for (const char* text : texts) add_node_edit(edits, "", text);
        return yard.with(edits);
    };
    // The instances' translation is column 3. Scaling comes first, then rotation about X, Y and Z, then translation.
    const char *const lifted = "group=translate:0,0,3", *const all = "box b=translate:0,0,1,rotate:90,0,90,scale:1,2,1";
    const struct {
        std::vector<const char*> edits;
        std::size_t instance;
        int column;
        dvec3 expected;
    } cases[] = {{{lifted}, 0, 3, {2, 0, 3}},
                 {{lifted}, 1, 3, {5, 0, 0}},
                 {{"group=rotate:0,0,90"}, 0, 3, {1, 1, 0}},  // through the group's origin
                 {{"group=scale:2"}, 0, 3, {3, 0, 0}},
                 {{"group=scale:2"}, 0, 0, {2, 0, 0}},
                 {{all}, 1, 3, {5, 0, 1}},
                 {{all}, 1, 1, {0, 0, 2}},  // Y doubled, X turns it to Z, Z keeps it
                 {{all}, 1, 0, {0, 1, 0}},
                 // The order of objects does not matter: the box turns about its own origin, then moves with the group.
                 {{lifted, "box a=rotate:0,0,90"}, 0, 3, {2, 0, 3}},
                 {{lifted, "box a=rotate:0,0,90"}, 0, 0, {0, 1, 0}},
                 {{"box a=rotate:0,0,90", lifted}, 0, 3, {2, 0, 3}},
                 {{"box a=rotate:0,0,90", lifted}, 0, 0, {0, 1, 0}},
                 // Two edits of a node apply in their order, the second about the moved origin.
                 {{"box*=translate:0,0,3", "box a=rotate:0,90,0"}, 0, 3, {2, 0, 3}},
                 {{"group=matrix:2,0,0,0,0,2,0,0,0,0,2,0"}, 0, 3, {2, 0, 0}}};
    for (const auto& [edits, instance, column, expected] : cases)
        EXPECT_LT(glm::length(dvec3(moved(edits).instances[instance].object_to_world[column]) - expected), 1e-12)
            << edits[0] << ", column " << column;
    EXPECT_LT(glm::length(moved({lifted}).lights[0].position - dvec3(1, 1, 3)), 1e-12);
    const PunctualLight turned = moved({"group=rotate:0,0,90"}).lights[0];
    EXPECT_LT(glm::length(turned.position), 1e-12);
    EXPECT_LT(glm::length(turned.direction - vec3(1, 0, 0)), 1e-6f);
    const dmat4 m(dvec4(0.1, 0, 0, 0), dvec4(0, 0.7, 0, 0), dvec4(0, 0, 1, 0), dvec4(0.3, 0, 1e-3, 1));
    EXPECT_EQ(moved({"box a=matrix:0.1,0,0,0.3,0,0.7,0,0,0,0,1,1e-3", lifted}).instances[0].object_to_world, m)
        << "a node with a matrix does not follow others";
}

TEST(NodeEdits, HideNodesMeshesAndLights) {
    const Yard yard;
    const auto hidden = [&](const char* name) { return yard.with(edits_of({{add_hidden, name}})); };
    const Scene group = hidden("group");
    ASSERT_EQ(group.instances.size(), 1u);
    EXPECT_EQ(group.instances[0].name, "box b");
    EXPECT_EQ(group.lights[0].intensity, vec3(0)) << "the lamp hangs below the group";
    EXPECT_EQ(hidden("mesh:crate").instances.size(), 1u);
    EXPECT_EQ(hidden("wall").instances.size(), 1u);
    EXPECT_EQ(hidden("node:1").instances.at(0).name, "box b");
    EXPECT_EQ(hidden("box*").instances.size(), 0u);
    EXPECT_EQ(hidden("light:key").lights[0].intensity, vec3(0));
    SceneEdits bright = edits_of({{add_hidden, "key"}, {add_light_edit, "key=intensity:5"}});
    EXPECT_EQ(yard.with(bright).lights[0].intensity, vec3(0)) << "hidden lights stay dark";
    EXPECT_TRUE(change_surfaces(edits_of({{add_hidden, "wall"}})));
    EXPECT_FALSE(change_surfaces(edits_of({{add_hidden, "light:key"}})));
}

TEST(NodeEdits, MakeShadowCatchers) {
    const Yard yard;
    const auto catching = [&](const char* name) {
        std::string names;
        for (const Instance& i : yard.with(edits_of({{add_catcher, name}})).instances)
            if (i.catcher) names += i.name + ";";
        return names;
    };
    EXPECT_EQ(catching("box b"), "box b;");
    EXPECT_EQ(catching("node:box*"), "box a;box b;");
    EXPECT_NE(catching("group").find("box a;"), std::string::npos) << "nodes have everything below them";
    EXPECT_NE(catching("mesh:crate"), "");
    EXPECT_TRUE(change_surfaces(edits_of({{add_catcher, "wall"}})));
}

TEST(LightEdits, NameTheOptionForMaterialsThatEmit) {
    Yard yard;
    yard.scene.materials[2].name = "panel";
    yard.scene.materials[2].emission = vec3(5);
    expect_refusal([&] { yard.with(edits_of({{add_light_edit, "panel=off"}})); }, "--material 'panel.emission=R,G,B'");
    const vec3 warm =
        yard.with(edits_of({{add_material_edit, "panel.emission_temperature=2700"}})).materials[2].emission;
    EXPECT_EQ(warm.r, 5) << "the largest channel stays";
    EXPECT_GT(warm.g, 2 * warm.b);
}

TEST(LightEdits, ReplaceTheDistribution) {
    const TemporaryFolder folder;
    const std::string path = folder.path / "lamp.ies";
    write_file(path, test::washer().text());
    const Yard yard;
    SceneEdits edits;
    light_edit(edits, "key").ies = path;
    Scene edited = yard.with(edits);
    validate(edited);
    const PunctualLight& lamp = edited.lights[0];
    const float candela = edited.light_profiles.at(std::size_t(lamp.profile)).candela;
    EXPECT_EQ(profile_of_file(edited, path), &edited.light_profiles[0]);
    EXPECT_LT(glm::distance(lamp.intensity, candela * vec3(0.25f, 0.5f, 1)), 1e-3f) << "the colour stays";
    write_file(path, test::downlight().text());
    EXPECT_NE(yard.with(edits).light_profiles.at(0).shares, edited.light_profiles[0].shares) << "a changed file";
    write_file(path, test::washer().text());
    Yard dark;
    dark.scene.lights[0].intensity = vec3(0);
    EXPECT_EQ(dark.with(edits).lights[0].intensity, vec3(0)) << "a lamp that is off stays off";
    light_edit(edits, "key").intensity = 10.0f;
    EXPECT_EQ(yard.with(edits).lights[0].intensity, vec3(2.5f, 5, 10));

    // Axes turn with the direction and with nodes.
    light_edit(edits, "key").direction = dvec3(0, 0, -1);
    edited = yard.with(edits);
    EXPECT_LT(glm::distance(edited.lights[0].right, lamp.right), 1e-6f);
    EXPECT_LT(glm::distance(edited.lights[0].up, glm::cross(vec3(0, 0, 1), lamp.right)), 1e-6f);
    light_edit(edits, "key").direction.reset();
    node_edit(edits, "group").rotate = {0, 90, 0};
    edited = yard.with(edits);
    EXPECT_LT(glm::distance(edited.lights[0].direction, vec3(0, -1, 0)), 1e-6f);
    EXPECT_LT(glm::distance(edited.lights[0].right, vec3(0, 0, -1)), 1e-6f);
    validate(edited);
}

TEST(LightEdits, ReplaceIntensityAndColour) {
    const Yard yard;
    const auto light = [&](const char* text) { return yard.with(edits_of({{add_light_edit, text}})).lights[0]; };
    const std::pair<const char*, vec3> intensities[] = {{"key=0.5", {1, 2, 4}},
                                                        {"key=factor:0.5,intensity:16", {2, 4, 8}},
                                                        {"key=color:1,0.5,0", {8, 4, 0}},
                                                        {"key=intensity:2,color:#fff", vec3(2)},
                                                        {"key=off", vec3(0)}};
    for (const auto& [text, intensity] : intensities) EXPECT_EQ(light(text).intensity, intensity) << text;
    EXPECT_EQ(light("key=position:1,2,3").position, dvec3(1, 2, 3));
    EXPECT_EQ(light("k*=direction:0,0,-2").direction, vec3(0, 0, -1));
    SceneEdits sizes;
    sizes.lamp_radius = 0.5f, sizes.sun_angle = 90.0f;
    EXPECT_EQ(yard.with(sizes).lights[0].radius, 0.5f);
    sizes.lights = edits_of({{add_light_edit, "key=radius:0.25"}}).lights;
    EXPECT_EQ(yard.with(sizes).lights[0].radius, 0.25f) << "a named light has its own size";
    EXPECT_NEAR(yard.with(sizes).lights[0].angle, kPi / 2, 1e-6);
    const vec3 warm = light("key=temperature:2700").intensity;
    EXPECT_EQ(warm.r, 8);
    EXPECT_GT(warm.g, 2 * warm.b);
    EXPECT_EQ(yard.with(edits_of({{add_light_edit, "key=off"}, {add_light_edit, "key=on"}})).lights[0].intensity,
              yard.scene.lights[0].intensity);
}

constexpr const char* kPanel = "panel=kind:rectangle,position:0,3,0,size:2,1,intensity:40,color:1,0.5,0.25";

TEST(AddedLights, AreLightsLikeOthers) {
    const Yard yard;
    SceneEdits edits = edits_of({{add_new_light, kPanel},
                                 {add_new_light, "fill=kind:spot,position:0,2,0,direction:2,0,0,intensity:50,outer:30"},
                                 {add_new_light, "day=kind:sun,angle:1"},
                                 {add_light_edit, "fill=inner:10,radius:0.1"},
                                 {add_light_edit, "p*=factor:2"},
                                 {add_hidden, "light:day"},
                                 {add_light_group, "added=fill,panel"},
                                 {add_light_link, "light:panel=-crate"}});
    EXPECT_EQ(find_light_edit(edits, "fill")->radius, 0.1f) << "later values belong to the added light";
    const Scene scene = yard.with(edits);
    ASSERT_EQ(scene.lights.size(), 3u);
    EXPECT_EQ(scene.lights[0].intensity, yard.scene.lights[0].intensity);
    const PunctualLight& fill = scene.lights[1];
    EXPECT_EQ(fill.type, LightType::spot);
    EXPECT_EQ(fill.intensity, vec3(50));
    EXPECT_EQ(fill.direction, vec3(1, 0, 0));
    EXPECT_NEAR(glm::degrees(fill.inner_cone), 10, 1e-5);
    EXPECT_NEAR(glm::degrees(fill.outer_cone), 30, 1e-5);
    EXPECT_EQ(fill.light_group, 0u);
    EXPECT_EQ(scene.lights[2].intensity, vec3(0)) << "it is hidden";
    EXPECT_EQ(scene.lights[2].direction, vec3(0, -1, 0)) << "lamps shine down";
    ASSERT_EQ(scene.instances.size(), 3u);
    const Instance& panel = scene.instances[2];
    EXPECT_TRUE(panel.added) << "world_bounds() leaves it out";
    const Mesh& mesh = scene.meshes.at(static_cast<std::size_t>(panel.mesh));
    const Material& front = scene.materials.at(mesh.triangle_material[0]);
    EXPECT_EQ(front.emission, vec3(80, 40, 20)) << "a pattern finds it";
    EXPECT_EQ(front.light_group, 0u);
    EXPECT_EQ(front.links.receivers & (std::uint64_t{1} << scene.instances[0].link_class), 0u);
    EXPECT_EQ(scene.materials[mesh.triangle_material.back()].emission, vec3(0)) << "its body is black";
    EXPECT_EQ(materials_of(scene).names.size(), yard.scene.materials.size());
    EXPECT_EQ(lights_of(scene).names, (std::vector<std::string_view>{"key", "fill", "day", "panel"}));
    validate(scene);
    Scene emptied = scene;
    remove_added(emptied);
    EXPECT_EQ(emptied.instances.size(), 2u);
    EXPECT_EQ(emptied.meshes.size(), yard.scene.meshes.size());
    EXPECT_EQ(emptied.materials.size(), yard.scene.materials.size());
    add_light_edit(edits, "", "panel=off");
    EXPECT_EQ(yard.with(edits).instances.size(), 2u) << "no surface is left of a panel that is off";
}

using AddedLightFile = GltfTest;

TEST_F(AddedLightFile, HasTheSurfacesOfAddedLights) {
    GltfBuilder b;
    b.add_triangle();
    b.json["extensions"]["EXT_lights_area"]["lights"] = {
        {{"type", "rect"}, {"size", 2}, {"rect", {{"aspect", 3}}}, {"intensity", 7}},
        {{"type", "disk"}, {"size", 4}, {"intensity", 5}}};
    for (int i = 0; i < 2; ++i)
        b.push("nodes", {{"translation", {1, 2, 3 + i}}, {"extensions", {{"EXT_lights_area", {{"light", i}}}}}});
    b.require({"EXT_lights_area"});
    const Scene file = load(b);
    Scene scene = file;
    apply(edits_of({{add_new_light, "a=kind:rectangle,position:1,2,3,direction:0,0,-1,size:6,2,intensity:7"},
                    {add_new_light, "b=kind:disc,position:1,2,4,direction:0,0,-1,size:4,intensity:5"}}),
          scene);
    ASSERT_EQ(scene.instances.size(), file.instances.size() + 2);
    for (const std::size_t i : {1, 2}) {
        const Instance &own = scene.instances[i], &added = scene.instances[i + 2];
        const Mesh& mesh = scene.meshes[static_cast<std::size_t>(own.mesh)];
        const Mesh& other = scene.meshes[static_cast<std::size_t>(added.mesh)];
        EXPECT_EQ(mesh.positions, other.positions);
        ASSERT_EQ(mesh.normals.size(), other.normals.size());
        for (std::size_t n = 0; n < mesh.normals.size(); ++n)
            EXPECT_LT(glm::distance(mesh.normals[n], other.normals[n]), 1e-6f);
        EXPECT_EQ(mesh.triangles, other.triangles);
        EXPECT_EQ(own.object_to_world, added.object_to_world);
        const Material& front = scene.materials[other.triangle_material[0]];
        EXPECT_EQ(front.emission, scene.materials[mesh.triangle_material[0]].emission);
        EXPECT_EQ(front.specular, 0.0f);
    }
}

TEST(AddedLights, HierarchiesFollowTheirSurfacesAlone) {
    const auto surfaces = [](std::initializer_list<std::pair<AddEdit, const char*>> texts) {
        return surface_edits(edits_of(texts));
    };
    const SceneEdits panel = surfaces({{add_new_light, kPanel}});
    EXPECT_EQ(surfaces({{add_new_light, kPanel}, {add_light_edit, "panel=intensity:3,color:1,1,1"}}), panel);
    EXPECT_NE(surfaces({{add_new_light, kPanel}, {add_light_edit, "panel=position:0,1,0"}}), panel);
    EXPECT_NE(surfaces({{add_new_light, kPanel}, {add_light_edit, "p*=off"}}), panel);
    EXPECT_EQ(surfaces({{add_new_light, "day=kind:sun"}, {add_light_edit, "key=position:0,1,0"}}), SceneEdits());
}

TEST(AddedLights, UnusableOnesAreOneLine) {
    const Yard yard;
    const auto refuse = [&](const std::vector<const char*>& lights, const std::string& element) {
        expect_refusal(
            [&] {
                SceneEdits edits;
                for (const char* light : lights) add_new_light(edits, "--add-light", light);
                check_edits(edits, yard.scene, yard.tree);
            },
            element, "--add-light");
    };
    refuse({"a=position:0,0,0"}, "expects NAME=kind:KIND");
    refuse({"a=kind:lamp,position:0,0,0"}, "kind: 'lamp' is none of point, spot, sun, rectangle, disc");
    refuse({"a=kind:point,kind:spot,position:0,0,0"}, "two kinds");
    refuse({"a=kind:point"}, "a point needs a position");
    refuse({"a=kind:point,position:0,1e13,0"}, "position: expects numbers");
    refuse({"a=kind:point,position:0,0,0,intensity:-1"}, "intensity");
    refuse({"a=kind:disc,position:0,0,0,size:0"}, "size: expects numbers from");
    refuse({"a=kind:disc,position:0,0,0,size:1,2,3"}, "size: expects one number or two");
    refuse({"a=kind:disc,position:0,0,0,radius:1"}, "light 'a': a disc has no radius");
    refuse({"a=kind:sun,position:0,0,0"}, "light 'a': a sun has no position");
    refuse({"a=kind:point,position:0,0,0,direction:0,1,0"}, "a point has no direction");
    refuse({"a=kind:spot,position:0,0,0,inner:40,outer:20"}, "is not less than outer");
    refuse({"a=kind:sun", "a=kind:sun"}, "light 'a' is added twice");
    refuse({"key=kind:sun"}, "the scene has a light 'key'");
    refuse({"7=kind:sun"}, "'7' cannot name a light");
    refuse({"a*=kind:sun"}, "'a*' cannot name a light");
    SceneEdits invalid;
    invalid.added_lights = {{"a", LampKind::disc, {.position = dvec3(0), .size = vec2(0, 1)}}};
    expect_refusal([&] { yard.with(invalid); }, "size: 0 is outside");
    invalid.added_lights = {{"a", LampKind::point, {.position = dvec3(0, NAN, 0)}}};
    expect_refusal([&] { yard.with(invalid); }, "position: nan is outside");
    Scene scene = yard.scene;
    EXPECT_NE(error_message([&] { apply(invalid, scene, yard.tree); }), "");
    EXPECT_EQ(scene.lights.size(), 1u) << "a scene stays as it was";
    expect_refusal([&] { edits_in_file(R"("added_lights": {"a": {"position": [0, 0, 0]}})"); }, "has no 'kind'");
    expect_refusal([&] { edits_in_file(R"("added_lights": {"a": {"kind": "lamp"}})"); },
                   "added_lights.a: kind: 'lamp'");
    expect_refusal([&] { yard.with(edits_in_file(R"("added_lights": {"a": {"kind": "sun"}}, "lights": {"a": 2})")); },
                   "light 'a' has a further edit");
}

TEST(MaterialEdits, ReplaceProperties) {
    const Yard yard;
    const auto edited = [&](const char* text) { return yard.with(edits_of({{add_material_edit, text}})).materials; };
    EXPECT_EQ(edited("steel.1.roughness=0.25")[2].roughness, 0.25f);
    EXPECT_EQ(edited("0.base_color=0.5,0.25,1")[0].base_color, vec4(0.5f, 0.25f, 1, 1));
    EXPECT_EQ(edited("wo?d*.metallic=0")[0].metallic, 0);
    EXPECT_EQ(vec3(edited("1.base_color=#f00")[1].base_color), vec3(1, 0, 0));
    Yard glass;
    for (const std::size_t m : {0, 1}) glass.scene.materials[m].transmission = glass.scene.materials[m].thickness = 1;
    glass.scene.materials[0].metallic = glass.scene.materials[1].metallic = 0;
    SceneEdits straight = edits_of({{add_material_edit, "1.straight_shadows=0"}});
    straight.straight_glass = true;
    const std::vector<Material> now = glass.with(straight).materials;
    EXPECT_TRUE(now[0].straight_shadows);
    EXPECT_FALSE(now[1].straight_shadows) << "a named material has its own choice";
}

TEST(SceneEdits, InvalidTextsAreNamed) {
    const struct {
        AddEdit add;
        const char* text;
        const char* element;
    } refusals[] = {{add_hidden, "grup", "yard: there is no node, mesh or light 'grup'"},
                    {add_hidden, "1", "yard: '1' needs a kind"},
                    {add_hidden, "mesh:box a", "yard: there is no mesh 'box a'"},
                    {add_catcher, "grup", "yard: there is no node or mesh 'grup'"},
                    {add_catcher, "", "expects the name of a node or a mesh"},
                    {add_light_edit, "kye=off", "yard: there is no light 'kye'"},
                    {add_light_edit, "wood=off", "yard: there is no light 'wood'"},
                    {add_light_edit, "key", "not 'key'"},
                    {add_light_edit, "key=colour:1,1,1", "key: 'colour'"},
                    {add_light_edit, "key=color:mauve", "key: color: "},
                    {add_light_edit, "key=temperature:900", "key: temperature: "},
                    {add_light_edit, "key=radius:-1", "key: radius: "},
                    {add_light_edit, "key=angle:180", "key: angle: "},
                    {add_light_edit, "key=position:1,2", "key: position: "},
                    {add_light_edit, "key=intensity:nan", "key: intensity: "},
                    {add_material_edit, "0.emission_temperature=900", "0: emission_temperature: "},
                    {add_material_edit, "0.roughness=rough", "0: roughness: "},
                    {add_material_edit, "0.roughness=2", "0: roughness: 2"},
                    {add_material_edit, "steel.1.rouhgness=1", "steel.1: materials have no property 'rouhgness'"},
                    {add_material_edit, "roughness=1", "not 'roughness=1'"},
                    {add_node_edit, "group=scale:0", "group: scale: 0"},
                    {add_node_edit, "group=matrix:1,2", "group: matrix: "},
                    {add_node_edit, "grop=scale:2", "yard: there is no node 'grop'"},
                    {add_node_edit, "eye=translate:0,0,1", "yard: node 'eye' has no surface"}};
    Yard yard;
    yard.tree.nodes.push_back({"eye", 0, true, dmat4(1)});
    for (const auto& [add, text, element] : refusals)
        expect_refusal([&] { yard.with(edits_of({{add, text}})); }, element, "--option: ");
    EXPECT_NO_THROW(yard.with(edits_of({{add_node_edit, "*e*=translate:0,0,1"}}))) << "others of the pattern move";
    SceneEdits twice;
    twice.lights = {{"key", {}}, {"key", {}}};
    expect_refusal([&] { yard.with(twice); }, "yard: light 'key'");
}

/// CIE illuminant A is a black body of 2856 K. The fit of the matching functions is exact to some thousandths.
TEST(BlackBody, HasTheChromaticityOfIlluminantA) {
    const auto chromaticity = [](double kelvin) {
        const dvec3 c(black_body_color(kelvin));
        const dvec3 xyz(0.4124 * c.r + 0.3576 * c.g + 0.1805 * c.b, 0.2126 * c.r + 0.7152 * c.g + 0.0722 * c.b,
                        0.0193 * c.r + 0.1192 * c.g + 0.9505 * c.b);
        return dvec2(xyz) / (xyz.x + xyz.y + xyz.z);
    };
    EXPECT_LT(glm::length(chromaticity(2856) - dvec2(0.44757, 0.40745)), 0.004);
    EXPECT_LT(glm::length(chromaticity(6500) - dvec2(0.3135, 0.3237)), 0.004);
    EXPECT_LT(glm::length(chromaticity(10000) - dvec2(0.2807, 0.2884)), 0.004);
    for (const double kelvin : {1000.0, 1900.0, 40000.0}) {
        const vec3 c = black_body_color(kelvin);
        EXPECT_EQ(std::max({c.r, c.g, c.b}), 1) << kelvin;
        EXPECT_GE(std::min({c.r, c.g, c.b}), 0) << kelvin;
    }
}

TEST(BlackBody, IsFoundByItsColor) {
    for (double kelvin = 1000; kelvin <= 12000; kelvin += 50)  // below about 1900 K there is no blue
        EXPECT_NEAR(nearest_black_body(black_body_color(kelvin), 1000, 12000), kelvin, 0.5);
    EXPECT_NEAR(nearest_black_body(vec3(1, 0, 0), 1000, 12000), 1000, 0.5);
    EXPECT_NEAR(nearest_black_body(vec3(0, 0, 1), 1000, 12000), 12000, 0.5);
}

TEST(EditTexts, RestoreTheEditExactly) {
    LightEdit light{.factor = 0.1f,
                    .color = vec3(0.1f, 0.7f, 1),
                    .position = dvec3(1.0 / 3, -1e7, 1e-30),
                    .direction = unit_direction({1, 2, 3}),
                    .intensity = 1.0f / 3,
                    .off = true};
    const dmat4 matrix(dvec4(0.1, 0, 0, 0), dvec4(0, 0.7, 0.2, 0), dvec4(0, 0, 1, 0), dvec4(0.3, 4, 1e-3, 1));
    const NodeEdit node{{0.1, 1.0 / 3, 0}, {45, 0, -1e-5}, {1, 2, 1.0 / 7}, matrix};
    SceneEdits edits;
    add_light_edit(edits, "", "a = b=" + text(light));
    add_node_edit(edits, "", "n=" + text(node));
    EXPECT_EQ(edits.lights.at(0).name, "a = b");
    light.direction = edits.lights[0].edit.direction;  // normalised again
    EXPECT_LT(glm::length(*light.direction - *unit_direction({1, 2, 3})), 1e-15);
    EXPECT_EQ(edits.lights[0].edit, light);
    EXPECT_EQ(edits.nodes.at(0).edit, node);
    EXPECT_EQ(text(LightEdit{.factor = 2, .temperature = 2700.5f}), "factor:2,temperature:2700.5");
}

TEST(EditTexts, FilesKeepAddedLights) {
    const SceneEdits edits = edits_of({{add_new_light, "b=kind:sun,direction:1,-2,3,angle:0.53"},
                                       {add_new_light, kPanel},
                                       {add_new_light, "a=kind:spot,position:0,1,0,inner:20,outer:31.5"},
                                       {add_light_edit, "b=off"}});
    SavedSettings saved;
    saved.edits = edits;
    SceneEdits read = parse_settings(settings_text(saved, "."), "a.json").edits;
    ASSERT_EQ(read.added_lights.size(), 3u);
    EXPECT_LT(glm::distance(*read.added_lights[0].edit.direction, *edits.added_lights[0].edit.direction), 1e-12);
    read.added_lights[0].edit.direction = edits.added_lights[0].edit.direction;  // normalised again
    EXPECT_EQ(read.added_lights, edits.added_lights);
    EXPECT_EQ(
        edits_in_file(R"("added_lights": {"a": {"kind": "disc", "position": [0, 1, 0], "size": 2}})").added_lights,
        edits_of({{add_new_light, "a=kind:disc,position:0,1,0,size:2"}}).added_lights);
}

TEST(EditTexts, NumbersAreNamesInFilesAndOptions) {
    const Yard yard;
    for (const char* file : {R"("lights": {"0": 0.5})", R"("lights": [0.5])"}) {
        SceneEdits edits = edits_in_file(file);
        EXPECT_EQ(yard.with(edits).lights[0].intensity, 0.5f * yard.scene.lights[0].intensity) << file;
        add_light_edit(edits, "--light", "0=2");
        EXPECT_EQ(yard.with(edits).lights[0].intensity, 2.0f * yard.scene.lights[0].intensity) << file;
    }
    EXPECT_EQ(edits_in_file(R"("lights": [1, {"factor": 1}, {"off": true}])").lights,
              (std::vector<NamedEdit<LightEdit>>{{"2", {.off = true}}}));
    SceneEdits steel = edits_in_file(R"("materials": {"2": {"roughness": 0.5, "metallic": 1}})");
    add_material_edit(steel, "--material", "2.roughness=0.25");
    EXPECT_EQ(steel.materials.size(), 1u);
    EXPECT_EQ(yard.with(steel).materials[2].roughness, 0.25f);
    EXPECT_EQ(yard.with(steel).materials[2].metallic, 1);
    expect_refusal([&] { yard.with(edits_in_file(R"("lights": {"7": 0.5})")); },
                   "a.json: lights: yard: there is no light 7");
}

TEST(EditTexts, FilesTakeTheTextsOfOptions) {
    EXPECT_EQ(edits_in_file(R"("lights": {"key": {"temperature": 2700, "off": true}, "fill": 0.5})"),
              edits_of({{add_light_edit, "key=temperature:2700,off"}, {add_light_edit, "fill=0.5"}}));
    EXPECT_EQ(edits_in_file(R"("materials": {"floor": {"base_color": "#8899cc", "roughness": 0.3}})"),
              edits_of({{add_material_edit, "floor.base_color=#8899cc"}, {add_material_edit, "floor.roughness=0.3"}}));
    EXPECT_EQ(edits_in_file(R"("nodes": {"crate": {"rotate": [0, 45, 0], "scale": 2}}, "hide": ["wall*"])"),
              edits_of({{add_node_edit, "crate=rotate:0,45,0,scale:2"}, {add_hidden, "wall*"}}));
}

TEST(NeutralLight, FollowsTheChosenCamera) {
    const TemporaryFolder folder;
    const std::filesystem::path path = test::copy_room(folder.path, false);
    CameraChoice side;
    side.look_from = dvec3(5, 1, 0), side.look_at = dvec3(0);
    const auto map = [](double azimuth) { return preset_sky(SkyPreset::neutral, azimuth).environment.map.pixels; };
    const auto lit_by = [](const LoadedScene& scene) { return scene.scene().environment.map.pixels; };
    EXPECT_EQ(lit_by(LoadedScene({.scene = path}, side, Log())), map(90));
    EXPECT_EQ(lit_by(LoadedScene({.scene = path, .light_azimuth = 20.0}, side, Log())), map(20));
    LoadedScene scene({.scene = path, .environment = SkyPreset::neutral, .edits = {.environment_intensity = 0.5f}});
    EXPECT_NE(lit_by(scene), map(90));
    const std::uint64_t revision = scene.revision();
    scene.set_camera(side);
    EXPECT_EQ(lit_by(scene), map(90));
    EXPECT_GT(scene.revision(), revision);
    EXPECT_EQ(scene.scene().environment.color, 0.5f * preset_sky(SkyPreset::neutral, 90).environment.color);
    scene.edit({});
    EXPECT_EQ(lit_by(scene), map(90)) << "without edits, too";
}

TEST(NodeEdits, FollowAnimationsOfALoadedScene) {
    const TemporaryFolder folder;
    LoadedScene scene({.scene = test::write_sliding_light(folder.path), .animation = "slide"});
    const auto position = [&] { return dvec3(scene.scene().instances.at(0).object_to_world[3]); };
    const dvec3 start = position();
    scene.pose(1);
    const dvec3 later = position();
    ASSERT_NE(start, later);
    scene.edit(edits_of({{add_node_edit, "0=translate:0,0,5"}}));
    EXPECT_EQ(position(), later + dvec3(0, 0, 5));
    scene.pose(0);
    EXPECT_EQ(position(), start + dvec3(0, 0, 5));
    const std::uint64_t before = scene.transform_revision();
    expect_refusal([&] { scene.edit(edits_of({{add_node_edit, "77=scale:2"}})); }, "there is no node 77");
    EXPECT_EQ(position(), start + dvec3(0, 0, 5)) << "an invalid edit keeps the earlier ones";
    EXPECT_EQ(scene.transform_revision(), before);
    const std::size_t all = scene.scene().instances.size();
    scene.edit(edits_of({{add_hidden, "node:0"}}));
    EXPECT_EQ(scene.scene().instances.size(), all - 1);
    EXPECT_NE(scene.transform_revision(), before);
    scene.pose(1);
    EXPECT_EQ(scene.scene().instances.size(), all - 1);
    scene.edit({});
    EXPECT_EQ(position(), later);
}

TEST(EditKeys, LeaveOtherEditsOfAnAnimatedScene) {
    const TemporaryFolder folder;
    SceneChoice choice{.scene = test::write_fading_scene(folder.path, 8, 2),
                       .environment = vec3(1),
                       .edits = {.environment_intensity = 0.5f},
                       .animation = "all"};
    LoadedScene scene(choice);
    choice.keys.tracks = {{.of = EditTrack::Of::lights, .name = "0", .key = "factor", .keys = {{0, "3"}, {24, "5"}}}};
    scene.set_keys(choice.keys);
    const LoadedScene loaded(choice);
    EXPECT_EQ(scene.scene().environment.color, vec3(0.5f));
    EXPECT_EQ(loaded.scene().environment.color, vec3(0.5f));
    EXPECT_EQ(scene.scene().lights.at(0).intensity, loaded.scene().lights.at(0).intensity);
    scene.pose(1);
    scene.set_keys({});
    EXPECT_EQ(scene.scene().environment.color, vec3(0.5f));
}

TEST(EditKeys, ThatCutEndAShotAtTheirFrames) {
    const TemporaryFolder folder;
    SceneChoice choice{.scene = test::copy_room(folder.path, true)};
    choice.keys.tracks = {{.of = EditTrack::Of::camera,
                           .key = "from",
                           .keys = {{0, "0,1,3"}, {5, "0,1,4"}, {6.3, "0,1,5"}, {7, "0,1,6"}, {1000, "0,1,7"}},
                           .step = true}};
    LoadedScene scene(choice);
    const auto place = [&](double seconds) { return dvec3(scene.camera(seconds).camera.camera_to_world[3]); };
    for (const double frame : {4.0, 5.0, 6.0, 6.5, 7.0, 999.0, 1000.0}) {
        const double own = scene.time_of(frame);
        const auto [first, last] = scene.shot(own);
        for (const double frames : {-2000.0, -1.0, -0.25, 0.25, 1.0, 2000.0})
            EXPECT_EQ(place(std::clamp(scene.time_of(frame + frames), first, last)), place(own)) << frame << frames;
    }
}

/// The ground lies below the rest pose, moves with nothing, and is not framed.
TEST(NodeEdits, AGroundLiesBelowTheScene) {
    const TemporaryFolder folder;
    const std::filesystem::path path = test::write_sliding_light(folder.path);
    const SceneEdits edits{.ground = true};
    LoadedScene plain({.scene = path, .animation = "slide"}),
        at_once({.scene = path, .edits = edits, .animation = "slide"}), later({.scene = path, .animation = "slide"});
    later.edit(edits);
    const WorldBounds bounds = world_bounds(plain.scene());
    const std::size_t surfaces = plain.scene().instances.size(), meshes = plain.scene().meshes.size();
    const auto ground = [&](const Scene& scene) {
        EXPECT_EQ(scene.instances.size(), surfaces + 1);
        EXPECT_EQ(scene.meshes.size(), meshes + 1);
        validate(scene);
        return scene.instances.back();
    };
    for (LoadedScene* scene : {&at_once, &later}) {
        EXPECT_EQ(scene->chosen_camera().camera.camera_to_world, plain.chosen_camera().camera.camera_to_world);
        const Instance first = ground(scene->scene());
        EXPECT_TRUE(first.catcher);
        EXPECT_NEAR(first.object_to_world[3].y, bounds.lower.y, 1e-3 * (bounds.upper.x - bounds.lower.x));
        EXPECT_LT(first.object_to_world[3].y, bounds.lower.y);
        scene->pose(1);
        EXPECT_EQ(ground(scene->scene()).object_to_world, first.object_to_world);
        EXPECT_EQ(ground(scene->posed(0.5)).object_to_world, first.object_to_world);
        scene->edit({.ground = true, .ground_height = -7.0});
        EXPECT_EQ(ground(scene->scene()).object_to_world[3].y, -7);
        scene->edit({});
        EXPECT_EQ(scene->scene().instances.size(), surfaces);
        EXPECT_EQ(scene->scene().meshes.size(), meshes);
        expect_refusal([&] { scene->edit({.ground = true, .ground_height = 1e300}); }, "height of the ground");
    }
}

/// A default camera frames the scene as edited, whenever the edits were made.
TEST(NodeEdits, DefaultCamerasFrameTheEditedScene) {
    const TemporaryFolder folder;
    const std::filesystem::path path = folder / "a.glb";
    GltfBuilder b;
    b.add_triangle();
    b.push("nodes", {{"mesh", 0}, {"name", "far"}, {"translation", {50, 0, 0}}});
    test::write_text(path, b.glb());
    const SceneEdits edits = edits_of({{add_hidden, "far"}});
    for (const double aspect : {kUsualAspect, 1.0}) {
        LoadedScene at_once({.scene = path, .edits = edits}), later({.scene = path});
        later.frame_for(aspect);
        const dmat4 before = later.chosen_camera().camera.camera_to_world;
        later.edit(edits);
        for (LoadedScene* scene : {&at_once, &later}) scene->frame_for(aspect);
        EXPECT_EQ(later.chosen_camera().camera.camera_to_world, at_once.chosen_camera().camera.camera_to_world);
        EXPECT_NE(later.chosen_camera().camera.camera_to_world, before);
        later.edit({});
        later.frame_for(aspect);
        EXPECT_EQ(later.chosen_camera().camera.camera_to_world, before);
    }
}

/// An animated scale of 0 hides an object; edits find it at all times.
TEST(NodeEdits, FindObjectsWhileAnimationsHideThem) {
    const TemporaryFolder folder;
    constexpr const char* kMatrix = "blinking=matrix:1,0,0,0,0,1,0,7,0,0,1,0";
    const SceneEdits edits[] = {edits_of({{add_node_edit, "blinking=translate:0,2,0"}}),
                                edits_of({{add_node_edit, kMatrix}}), edits_of({{add_hidden, "mesh:cube"}}),
                                edits_of({{add_catcher, "blinking"}})};
    for (const bool at_first : {false, true}) {
        const std::array<vec3, 3> scales = {vec3(at_first ? 0 : 1), vec3(at_first ? 1 : 0), vec3(1)};
        const std::filesystem::path path = test::write_blinking_scene(folder.path, scales);
        std::size_t k = 0;
        for (const SceneEdits& each : edits) {
            LoadedScene scene({.scene = path, .edits = each, .animation = "blink"});
            for (const double time : {0.0, 1.0, 2.0}) EXPECT_NO_THROW(scene.pose(time)) << k << " at " << time;
            const Instance& last = scene.scene().instances.back();
            EXPECT_EQ(last.name == "blinking", k != 2);
            EXPECT_TRUE(k >= 2 || last.object_to_world[3].y == (k == 0 ? 3 : 7));
            EXPECT_EQ(last.catcher, k == 3);
            ++k;
        }
        std::filesystem::remove(path);
    }
    // Numbers of instances mean the same ones at all times.
    LoadedScene scene({.scene = test::write_blinking_scene(folder.path), .animation = "blink"});
    SceneEdits by_number;
    by_number.transforms[2] = dmat4(3);
    by_number.transforms[2][3] = {0, 5, 0, 1};
    scene.edit(by_number);
    for (const double time : {0.0, 1.0, 2.0}) {
        scene.pose(time);
        ASSERT_EQ(scene.scene().instances.size(), 3u);
        EXPECT_EQ(scene.scene().instances[2].object_to_world[3].y, 5);
        EXPECT_EQ(scene.scene().instances[1].name, "lamp");
    }
}

/// Names of cameras come before numbers, so digits as names need care.
TEST(SceneNames, CamerasAreChosenByTheirOptions) {
    Scene scene;
    for (const char* name : {"1", "0", "side", ""}) scene.cameras.emplace_back().name = name;
    const auto options = [&] { return name_facts(scene, {}, {})["cameras"]; };
    for (const auto& one : options()) {
        ASSERT_EQ(one["options"].size(), 1u) << one;
        const CameraChoice choice{.camera = one["options"][0][1].get<std::string>()};
        EXPECT_EQ(choose_camera(scene, choice).index, one["number"].get<std::size_t>()) << one;
    }
    scene.cameras[3].name = "side";
    EXPECT_EQ(options()[2]["options"][0][1], "2");
    scene.cameras[0].name = "2";
    EXPECT_TRUE(options()[2]["options"].empty()) << "'2' is another camera";
    EXPECT_EQ(choose_camera(scene, {.camera = "2"}).index, 0u);
}

/// The lines of `info --names` can be pasted after `halflight render`: they change nothing.
TEST(SceneNames, AreOptionsThatKeepTheScene) {
    Yard yard;
    yard.scene.lights[0].name = "it's \"key\"";
    const auto names = name_facts(yard.scene, yard.tree, {"red"});
    SceneEdits edits;
    for (const auto& [kind, list] : names.items())
        for (const auto& one : list)
            for (const auto& option : one.at("options")) {
                const std::string name = option.at(0), value = option.at(1);
                if (name == "--light") add_light_edit(edits, name, value);
                if (name == "--material") add_material_edit(edits, name, value);
                if (name == "--node") add_node_edit(edits, name, value);
            }
    EXPECT_EQ(edits.lights.size(), 1u);
    EXPECT_EQ(edits.nodes.size(), 4u);
    const Scene same = yard.with(edits);
    EXPECT_EQ(same.lights[0].intensity, yard.scene.lights[0].intensity);
    EXPECT_EQ(same.lights[0].position, yard.scene.lights[0].position);
    for (std::size_t i = 0; i < 2; ++i)
        EXPECT_EQ(same.instances[i].object_to_world, yard.scene.instances[i].object_to_world);
    const std::string lines = option_lines(names);
    for (const char* line :
         {"--light 'it'\\''s \"key\"=intensity:8,color:0.25,0.5,1,position:1,1,0,direction:0,-1,0,radius:0,inner:0,"
          "outer:45'\n",
          "--variant red\n", "--node 'box a=translate:0,0,0'\n"})
        EXPECT_NE(lines.find(line), std::string::npos) << lines;
    EXPECT_EQ(lines.find("other scene"), std::string::npos) << lines;
}

}  // namespace
}  // namespace halflight
