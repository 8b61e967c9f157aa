// Tests nodes of glTF files: transforms, instances, morph targets, skins, lights and cameras; and the environment.
#include <glm/gtc/matrix_transform.hpp>

#include "tests/unit/io/gltf_builder.h"

namespace halflight {
namespace {

using GltfNode = GltfTest;
using GltfDeformed = GltfTest;
using GltfSky = GltfTest;
using GltfLight = GltfTest;
using GltfCamera = GltfTest;

TEST_F(GltfNode, TransformsAndInstances) {
    GltfBuilder b;
    b.add_triangle();
    b.json["nodes"][0]["name"] = "parent";
    b.json["nodes"][0]["translation"] = {1e6, 0, 0.1};
    b.json["nodes"][0]["children"] = {1};
    b.push("nodes",
           {{"mesh", 0}, {"rotation", {0, 0, 2, 2}}, {"scale", {2, 3, -4}}});  // rotation by 90 degrees, not normalized
    b.push("nodes", {{"mesh", 0}, {"matrix", {0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 1, 0, 5, 6, 7, 1}}});
    b.push("scenes", {{"nodes", {2, 0}}});
    const Scene scene = load(b);
    EXPECT_EQ(scene.meshes.size(), 1u);
    ASSERT_EQ(scene.instances.size(), 3u);
    EXPECT_EQ(scene.instances[0].object_to_world[3], dvec4(5, 6, 7, 1));
    EXPECT_EQ(scene.instances[0].object_to_world[0], dvec4(0, 1, 0, 0));
    EXPECT_EQ(scene.instances[1].name, "parent");
    EXPECT_EQ(scene.instances[1].object_to_world[3], dvec4(1e6, 0, 0.1, 1)) << "in double";
    EXPECT_EQ(scene.instances[2].name, "mesh0");
    EXPECT_EQ(scene.instances[2].node, 1);
    const dmat4 expected(dvec4(0, 2, 0, 0), dvec4(-3, 0, 0, 0), dvec4(0, 0, -4, 0), dvec4(1e6, 0, 0.1, 1));
    for (int column = 0; column < 4; ++column)
        EXPECT_LT(glm::distance(scene.instances[2].object_to_world[column], expected[column]), 1e-14) << column;
}

TEST_F(GltfNode, TheDefaultSceneIsShown) {
    GltfBuilder b;
    b.add_triangle();
    b.push("nodes", {{"mesh", 0}, {"name", "second"}});
    EXPECT_EQ(load(b).instances.size(), 2u) << "all roots where there is no scene";
    b.json["scenes"] = {{{"nodes", {0}}}, {{"nodes", {1}}}};
    EXPECT_EQ(load(b).instances.at(0).node, 0);
    b.json["scene"] = 1;
    const Scene scene = load(b);
    ASSERT_EQ(scene.instances.size(), 1u);
    EXPECT_EQ(scene.instances[0].name, "second");
}

/// A scale of 0 hides surfaces only.
TEST_F(GltfNode, LightsAndCamerasKeepTheirDirectionsAtScalesOfZero) {
    GltfBuilder b;
    b.add_perspective_camera();
    b.json["extensions"]["KHR_lights_punctual"]["lights"] = {{{"type", "directional"}}};
    b.json["extensionsUsed"] = {"KHR_lights_punctual"};
    const double s = std::sqrt(0.5);
    const Json quarter = {0, s, 0, s};  // about Y: -Z becomes -X
    for (const Json& scale : {Json{0, 0, 0}, Json{1, 0, 1}, Json{1, 1, 0}}) {
        b.json["nodes"] = Json::array();
        b.push("nodes", {{"rotation", quarter}, {"scale", scale}, {"children", {1, 2}}, {"translation", {1, 2, 3}}});
        b.push("nodes", {{"camera", 0}});
        b.push("nodes", {{"extensions", {{"KHR_lights_punctual", {{"light", 0}}}}}});
        const Scene scene = load(b);
        EXPECT_LT(glm::distance(scene.lights.at(0).direction, vec3(-1, 0, 0)), 1e-6f) << scale;
        const dmat4& camera = scene.cameras.at(0).camera_to_world;
        EXPECT_LT(glm::distance(dvec3(camera[2]), dvec3(1, 0, 0)), 1e-9) << scale;
        EXPECT_EQ(camera[3], dvec4(1, 2, 3, 1));
        EXPECT_TRUE(scene.report.warnings.empty()) << scene.report.warnings[0];
    }
}

TEST_F(GltfNode, HiddenNodesHideTheirChildrenButNoCameras) {
    const auto visible = [](bool value) { return Json{{"KHR_node_visibility", {{"visible", value}}}}; };
    GltfBuilder b;
    b.add_triangle();
    b.add_perspective_camera();
    b.json["extensions"]["KHR_lights_punctual"]["lights"] = {{{"type", "point"}}};
    b.push("nodes", {{"mesh", 0}, {"children", {2, 3, 4}}, {"extensions", visible(false)}});
    b.push("nodes", {{"mesh", 0}, {"extensions", visible(true)}});
    b.push("nodes", {{"camera", 0}});
    b.push("nodes", {{"extensions", {{"KHR_lights_punctual", {{"light", 0}}}}}});
    b.json["extensionsUsed"] = {"KHR_lights_punctual", "KHR_node_visibility"};
    Scene scene = load(b);
    ASSERT_EQ(scene.instances.size(), 1u);
    EXPECT_EQ(scene.instances[0].node, 0);
    EXPECT_TRUE(scene.cameras.size() == 1 && scene.lights.empty() && scene.report.warnings.empty());
    b.json["nodes"][1]["extensions"]["KHR_node_visibility"] = Json::object();
    scene = load(b);
    EXPECT_TRUE(scene.instances.size() == 3 && scene.lights.size() == 1);
    expect_refused(b, {{"/nodes/1/extensions/KHR_node_visibility/visible", 0,
                        "nodes[1].extensions.KHR_node_visibility.visible: "}});
}

TEST_F(GltfNode, PropertiesWithoutEffectGiveWarnings) {
    GltfBuilder b;
    b.add_triangle();
    EXPECT_TRUE(load(b).report.warnings.empty());
    b.push("skins", {{"joints", {0}}});
    b.push("nodes", {{"skin", 0}});
    b.push("nodes", {{"weights", {1}}});
    b.push("nodes", {{"children", {1}}});
    b.push("scenes", {{"nodes", {0, 1, 2, 3}}});
    b.push("bufferViews", {{"buffer", 0}, {"byteLength", 0}});
    expect_warnings(load(b).report.warnings,
                    {"nodes[1]: has 'skin'", "nodes[2]: has 'weights'", "bufferViews[1]: ", "nodes[1]: is"});
}

TEST_F(GltfNode, NestedDeeply) {
    GltfBuilder b;
    constexpr int kDepth = 5000;
    for (int i = 0; i < kDepth; ++i) b.push("nodes", {{"translation", {0, 1, 0}}, {"children", {i + 1}}});
    b.add_triangle();
    const Scene scene = load(b);
    EXPECT_EQ(scene.instances.at(0).object_to_world[3].y, kDepth);
}

TEST_F(GltfNode, FlatAndVanishingTransforms) {
    GltfBuilder b;
    b.add_triangle();
    b.json["nodes"][0]["scale"] = {2, 2, 0};
    b.json["nodes"][0]["translation"] = {0, 0, 5};
    b.push("nodes", {{"mesh", 0}, {"scale", {0, 0, 0}}});
    b.push("nodes", {{"mesh", 0}});
    const Scene scene = load(b);
    ASSERT_EQ(scene.instances.size(), 2u);
    EXPECT_EQ(scene.instances[0].object_to_world, dmat4(1)) << "moved into the mesh";
    EXPECT_EQ(scene.meshes[0].positions[1], vec3(2, 0, 5));
    EXPECT_EQ(scene.meshes[1].positions[1], vec3(1, 0, 0));
    expect_warnings(scene.report.warnings, {"nodes[1]: "});
}

TEST_F(GltfNode, GpuInstancing) {
    GltfBuilder b;
    b.add_triangle();
    b.require({"EXT_mesh_gpu_instancing"});
    b.json["nodes"][0]["translation"] = {10, 0, 0};
    b.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"] = {
        {"TRANSLATION", b.floats("VEC3", {0, 0, 0, 1, 2, 3})},
        {"ROTATION", b.accessor("VEC4", kI8, std::vector<std::int8_t>{0, 0, 0, 127, 0, 0, 127, 0}, true)},
        {"SCALE", b.floats("VEC3", {1, 1, 1, 2, 2, 2})},
        {"_ID", b.floats("SCALAR", {1, 2})}};
    const Scene scene = load(b);
    EXPECT_EQ(scene.meshes.size(), 1u);
    ASSERT_EQ(scene.instances.size(), 2u);
    EXPECT_EQ(scene.instances[0].object_to_world, glm::translate(dmat4(1), dvec3(10, 0, 0)));
    const dmat4 half_turn(dvec4(-2, 0, 0, 0), dvec4(0, -2, 0, 0), dvec4(0, 0, 2, 0), dvec4(11, 2, 3, 1));
    EXPECT_EQ(scene.instances[1].object_to_world, half_turn);
    const int one = b.floats("VEC3", {1, 1, 1}), none = b.floats("VEC4", {});
    const std::string attributes = "/nodes/0/extensions/EXT_mesh_gpu_instancing/attributes/";
    expect_refused(b, {{attributes + "SCALE", one, "nodes[0]: "}, {attributes + "ROTATION", none, "nodes[0]: "}});
}

TEST_F(GltfNode, InstanceAttributesOfEveryType) {
    GltfBuilder b;
    b.add_triangle();
    const auto instanced = [&](const char* name, int accessor) {
        b.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"] = {{name, accessor}};
        return load(b);
    };
    for (const int rotations :
         {b.floats("VEC4", {0, 0, 0, 1, 0, 0, 0.70710678f, 0.70710678f}),
          b.accessor("VEC4", kI8, std::vector<std::int8_t>{0, 0, 0, 127, 0, 0, 90, 90}, true),
          b.accessor("VEC4", kI16, std::vector<std::int16_t>{0, 0, 0, 32767, 0, 0, 23170, 23170}, true)}) {
        const Scene scene = instanced("ROTATION", rotations);
        ASSERT_EQ(scene.instances.size(), 2u);
        const dmat3 turned(scene.instances[1].object_to_world);
        EXPECT_LT(glm::distance(turned[0], dvec3(0, 1, 0)), 1e-4) << "a quarter of a turn around z";
        EXPECT_NEAR(glm::determinant(turned), 1, 1e-12) << "rotations are normalised";
    }
    EXPECT_EQ(instanced("_ID", b.floats("SCALAR", {1, 2, 3})).instances.size(), 3u)
        << "attributes of applications alone give the number";
    expect_warnings(instanced("COLOR_0", b.floats("VEC3", {1, 0, 0})).report.warnings,
                    {"nodes[0]: instance attribute COLOR_0"});
}

TEST_F(GltfDeformed, MorphTargetsAtTheirDefaultWeights) {
    GltfBuilder b;
    Json& primitive = b.add_triangle();
    primitive["attributes"]["NORMAL"] = b.floats("VEC3", {0, 0, 1, 0, 0, 1, 0, 0, 1});
    primitive["targets"] = {{{"POSITION", b.floats("VEC3", {0, 0, 2, 0, 0, 4, 0, 0, 6})}},
                            {{"POSITION", b.floats("VEC3", {8, 0, 0, 0, 0, 0, 0, 0, 0})},
                             {"NORMAL", b.floats("VEC3", {4, 0, -4, 0, 0, 0, 0, 0, 0})}}};
    b.json["meshes"][0]["weights"] = {0.5, 0};
    b.push("nodes", {{"mesh", 0}, {"weights", {0, 0.25}}});
    b.push("nodes", {{"mesh", 0}});
    const Scene scene = load(b);
    ASSERT_EQ(scene.meshes.size(), 2u) << "nodes with the same weights share a mesh";
    ASSERT_EQ(scene.instances.size(), 3u);
    EXPECT_EQ(scene.instances[2].mesh, 0);
    EXPECT_EQ(scene.meshes[0].positions, (std::vector<vec3>{{0, 0, 1}, {1, 0, 2}, {0, 1, 3}}));
    EXPECT_EQ(scene.meshes[1].positions, (std::vector<vec3>{{2, 0, 0}, {1, 0, 0}, {0, 1, 0}}));
    EXPECT_EQ(scene.meshes[1].normals[0], vec3(1, 0, 0));
}

TEST_F(GltfDeformed, UnsupportedMorphTargetsAreReported) {
    GltfBuilder b;
    b.add_triangle()["targets"] = {{{"COLOR_0", b.floats("VEC3", std::vector<float>(9, 0))}}};
    EXPECT_TRUE(load(b).report.warnings.empty()) << "its weight is zero";
    b.json["meshes"][0]["weights"] = {1};
    EXPECT_EQ(load(b).report.warnings.size(), 1u);
}

/// Returns a triangle whose corners follow joint 0, joint 1, and both.
GltfBuilder skinned() {
    GltfBuilder b;
    Json& primitive = b.add_triangle();
    primitive["attributes"]["NORMAL"] = b.floats("VEC3", {0, 0, 1, 0, 0, 1, 1, 0, 0});
    primitive["attributes"]["JOINTS_0"] =
        b.accessor("VEC4", kU8, std::vector<std::uint8_t>{0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0});
    primitive["attributes"]["WEIGHTS_0"] = b.floats("VEC4", {1, 0, 0, 0, 2, 0, 0, 0, 0.5f, 0.5f, 0, 0});
    b.json["nodes"][0]["skin"] = 0;
    b.json["nodes"][0]["translation"] = {100, 100, 100};  // skins ignore this translation
    b.push("nodes", {{"translation", {0, 0, 5}}, {"children", {2}}});
    b.push("nodes", {{"scale", {2, 2, 2}}});
    b.push("skins", {{"joints", {1, 2}},
                     {"inverseBindMatrices", b.floats("MAT4", {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0,  1,  //
                                                               1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, -1, 1})}});
    return b;
}

TEST_F(GltfDeformed, SkinsAtRest) {
    GltfBuilder b = skinned();
    const Scene scene = load(b);
    ASSERT_EQ(scene.instances.size(), 1u);
    EXPECT_EQ(scene.instances[0].object_to_world, dmat4(1));
    const Mesh& mesh = scene.meshes.at(0);
    // Joint 0 adds 5 to z. Joint 1 adds 5 to the z of twice (x, y, z - 1). Weights are normalized.
    EXPECT_EQ(mesh.positions, (std::vector<vec3>{{0, 0, 5}, {2, 0, 3}, {0, 1.5f, 4}}));
    EXPECT_EQ(mesh.normals, (std::vector<vec3>{{0, 0, 1}, {0, 0, 1}, {1, 0, 0}}));
    b.json["skins"][0].erase("inverseBindMatrices");
    EXPECT_EQ(load(b).meshes.at(0).positions, (std::vector<vec3>{{0, 0, 5}, {2, 0, 5}, {0, 1.5f, 5}}));
}

TEST_F(GltfDeformed, SkinsWithoutAreaAreNamed) {
    GltfBuilder b = skinned();
    b.json["nodes"][1]["scale"] = {0, 0, 0};  // joint 1 is below it
    const Scene scene = load(b);
    EXPECT_TRUE(scene.instances.empty());
    expect_warnings(scene.report.warnings, {"meshes[0]: its joints leave no area"});
    GltfMeshSource source(write("scene.glb", b.glb()));
    source.read(0);
    expect_warnings(source.report().warnings, {"meshes[0]: its joints leave no area"});
    b.animate(1, "scale", b.floats("SCALAR", {0, 1}), b.floats("VEC3", {0, 0, 0, 1, 1, 1}));
    EXPECT_TRUE(open(b).at(0, kFirst).report.warnings.empty()) << "animations hide meshes so";
}

TEST_F(GltfDeformed, SkinsOfLines) {
    GltfBuilder b = skinned();
    b.json["meshes"][0]["primitives"][0]["mode"] = 3;
    const Mesh mesh = load(b, {.line_width = 0.2}).meshes.at(0);
    const std::size_t half = mesh.positions.size() / 4;  // two tubes of two ends
    const vec3 ends[] = {{0, 0, 5}, {2, 0, 3}, {2, 0, 3}, {0, 1.5f, 4}};
    const float radii[] = {0.1f, 0.2f, 0.2f, 0.15f};  // joint 1 doubles lengths
    for (std::size_t i = 0; i < mesh.positions.size(); ++i)
        EXPECT_NEAR(glm::distance(mesh.positions[i], ends[i / half]), radii[i / half], 1e-6f) << i;
}

TEST_F(GltfDeformed, InconsistentSkinsAreRefused) {
    expect_refused(skinned(), {{"/skins/0/joints", {1}, "meshes[0].primitives[0]: JOINTS_0"},
                               {"/skins/0/joints", {1, 2, 1}, "skins[0]: "},
                               {"/meshes/0/primitives/0/attributes/WEIGHTS_0", kRemoved, "meshes[0].primitives[0]: "}});
}

TEST_F(GltfNode, LensesAreFoundInExtrasOfCameras) {
    GltfBuilder b;
    b.add_perspective_camera();
    b.push("nodes", {{"camera", 0}});
    const auto expect_lens = [&](const Json& extras, const Lens& lens, const std::vector<std::string>& warnings = {}) {
        SCOPED_TRACE(extras.dump());
        b.json["cameras"][0]["extras"] = extras;
        const Scene scene = load(b);
        EXPECT_EQ(scene.cameras.at(0).lens, lens);
        expect_warnings(scene.report.warnings, warnings);
    };
    const Focus at_2{.kind = Focus::Kind::distance, .distance = 2};
    const Json usual = {{"aperture_fstop", 1.5}, {"focus_distance", 2}};
    expect_lens(usual, {.fstop = 1.5f, .focus = at_2});
    expect_lens({{"aperture_fstop", 1.5},
                 {"focus_distance", 2},
                 {"aperture_blades", 6},
                 {"aperture_rotation", kPi},
                 {"sensor_width", 24},
                 {"mood", "grey"}},
                {.fstop = 1.5f, .sensor = 24, .focus = at_2, .blades = 6, .rotation = 180});
    for (const Json& other : {Json(), Json(3), Json{{"focus_distance", 2}}, Json{{"aperture_fstop", 2}},
                              Json{{"aperture_fstop", 2}, {"focus_distance", 0}}})
        expect_lens(other, {});
    for (const Json& bad : {Json("2"), Json(-2), Json(1e300), Json(true), Json(), Json::array()})
        expect_lens({{"aperture_fstop", 2}, {"focus_distance", bad}}, {}, {"cameras[0].extras: focus_distance"});
    b.json["cameras"] = {
        {{"type", "orthographic"}, {"orthographic", {{"xmag", 1}, {"ymag", 1}, {"znear", 1}, {"zfar", 2}}}}};
    expect_lens(usual, {}, {"cameras[0]"});
}

TEST_F(GltfSky, InsideTheFile) {
    GltfBuilder b;
    EXPECT_TRUE(load(b).environment.black());
    b.json["extensionsUsed"] = {"HALFLIGHT_environment"};
    b.json["extensions"]["HALFLIGHT_environment"]["color"] = {0.5, 1, 2};
    const Scene scene = load(b);
    EXPECT_EQ(scene.environment.color, vec3(0.5f, 1, 2));
    EXPECT_TRUE(scene.environment.map.pixels.empty() && scene.report.warnings.empty());
    const std::string color = "/extensions/HALFLIGHT_environment/color";
    expect_refused(b, {{color, {0.5, -1, 2}, "extensions.HALFLIGHT_environment: "},
                       {color, {0.5, 1e200, 2}, "extensions.HALFLIGHT_environment: "},
                       {color, kRemoved, ""}});
}

TEST_F(GltfLight, OfEveryType) {
    GltfBuilder b;
    b.json["extensionsUsed"] = b.json["extensionsRequired"] = {"KHR_lights_punctual"};
    b.json["extensions"]["KHR_lights_punctual"]["lights"] = {
        {{"type", "point"}, {"name", "lamp"}, {"color", {1, 0.5, 0}}, {"intensity", 20}, {"range", 3}},
        {{"type", "spot"}, {"spot", {{"innerConeAngle", 0.25}, {"outerConeAngle", 0.5}}}},
        {{"type", "directional"}, {"intensity", 100000}},
        {{"type", "spot"}, {"spot", {{"innerConeAngle", 0.75}, {"outerConeAngle", 0.5}}}},
    };
    const double half = std::sqrt(0.5);
    b.json["nodes"] = {{{"translation", {1e6, 2, 3}}},
                       {{"name", "stage"}, {"scale", {5, 5, 5}}},
                       {{"rotation", {-half, 0, 0, half}}},  // a rotation of -Z to -Y
                       Json::object()};
    for (std::size_t i = 0; i < 4; ++i) b.json["nodes"][i]["extensions"]["KHR_lights_punctual"]["light"] = i;
    const Scene scene = load(b);
    ASSERT_EQ(scene.lights.size(), 4u);
    const PunctualLight &lamp = scene.lights[0], &stage = scene.lights[1], &sun = scene.lights[2];
    EXPECT_TRUE(lamp.type == LightType::point && lamp.name == "lamp");
    EXPECT_EQ(lamp.intensity, vec3(20, 10, 0));
    EXPECT_EQ(lamp.position, dvec3(1e6, 2, 3));
    EXPECT_TRUE(stage.type == LightType::spot && stage.name == "stage");
    EXPECT_EQ(vec2(stage.inner_cone, stage.outer_cone), vec2(0.25f, 0.5f));
    EXPECT_EQ(stage.direction, vec3(0, 0, -1));
    EXPECT_TRUE(sun.type == LightType::directional && sun.intensity == vec3(100000));
    EXPECT_LT(glm::distance(sun.direction, vec3(0, -1, 0)), 1e-6f);
    EXPECT_LT(scene.lights[3].inner_cone, scene.lights[3].outer_cone);
    EXPECT_EQ(scene.report.warnings.size(), 1u);
}

TEST_F(GltfLight, SizesAreFoundInExtras) {
    GltfBuilder b;
    b.json["extensionsUsed"] = {"KHR_lights_punctual"};
    const std::tuple<const char*, Json, float, float> cases[] = {
        {"point", {{"radius", 0.25}}, 0.25f, 0},
        {"point", {{"shadow_soft_size", 0.5}, {"angle", 1}}, 0.5f, 0},
        {"directional", {{"angle", 0.125}, {"shadow_soft_size", 3}}, 0, 0.125f},
        {"directional", {{"radius", 696000}}, 0, 0.0093049f},  // km, of the sun
        {"point", {{"radius", -1}}, 0, 0},
        {"point", {{"radius", "large"}}, 0, 0},
        {"directional", {{"angle", 1e300}}, 0, 0},
        {"point", "text", 0, 0},
        {"point", {{"radius", nullptr}}, 0, 0},
    };
    Json lights = Json::array();
    for (const auto& [type, extras, radius, angle] : cases) {
        b.json["nodes"][lights.size()]["extensions"]["KHR_lights_punctual"]["light"] = lights.size();
        lights.push_back({{"type", type}, {"extras", extras}});
    }
    b.json["extensions"]["KHR_lights_punctual"]["lights"] = lights;
    const Scene scene = load(b);
    ASSERT_EQ(scene.lights.size(), std::size(cases));
    for (std::size_t i = 0; i < scene.lights.size(); ++i) {
        EXPECT_EQ(scene.lights[i].radius, std::get<2>(cases[i])) << i;
        EXPECT_NEAR(scene.lights[i].angle, std::get<3>(cases[i]), 1e-7) << i;
    }
    const std::string element = "extensions.KHR_lights_punctual.lights[";
    expect_warnings(scene.report.warnings, {element + "4].extras: radius", element + "6].extras: angle"});
}

TEST_F(GltfLight, UnknownOrMissingOnesAreRefused) {
    GltfBuilder b;
    b.push("nodes", {{"extensions", {{"KHR_lights_punctual", {{"light", 0}}}}}});
    b.json["extensions"]["KHR_lights_punctual"]["lights"] = {{{"type", "point"}}};
    EXPECT_EQ(refusal(b), "");
    const std::string type = "/extensions/KHR_lights_punctual/lights/0/type";
    expect_refused(
        b, {{"/nodes/0/extensions/KHR_lights_punctual/light", 1, "nodes[0].extensions.KHR_lights_punctual.light: "},
            {type, "sphere", "extensions.KHR_lights_punctual.lights[0]: "}});
}

TEST_F(GltfCamera, PerspectiveAndOrthographic) {
    GltfBuilder b;
    b.json["cameras"] = {
        {{"type", "perspective"},
         {"name", "main"},
         {"perspective", {{"yfov", 0.75}, {"znear", 0.5}, {"aspectRatio", 2}}}},
        {{"type", "orthographic"}, {"orthographic", {{"xmag", 8}, {"ymag", -4}, {"znear", 0}, {"zfar", 100}}}}};
    b.push("nodes", {{"camera", 0}, {"scale", {3, -2, 5}}, {"translation", {1, 2, 3}}});
    b.push("nodes", {{"camera", 1}, {"name", "plan"}});
    b.push("nodes", {{"camera", 0}, {"name", "copy"}});
    const Scene scene = load(b);
    ASSERT_EQ(scene.cameras.size(), 3u);
    const Camera &p = scene.cameras[0], &o = scene.cameras[1];
    EXPECT_TRUE(p.name == "main" && !p.orthographic);
    EXPECT_EQ(dvec4(p.vertical_fov, p.aspect, p.near_plane, p.far_plane), dvec4(0.75, 2, 0.5, 0));
    // Scale does not affect the camera. Its basis stays right-handed, so mirroring y rotates it about its own axis.
    EXPECT_EQ(p.camera_to_world, dmat4(dvec4(-1, 0, 0, 0), dvec4(0, -1, 0, 0), dvec4(0, 0, 1, 0), dvec4(1, 2, 3, 1)));
    EXPECT_TRUE(o.name == "plan" && o.orthographic);
    EXPECT_EQ(dvec4(o.ortho_height, o.aspect, o.near_plane, o.far_plane), dvec4(8, 2, 0, 100));
    EXPECT_EQ(scene.cameras[2].name, "copy") << "a second use of a camera goes by its node's name";
}

TEST_F(GltfCamera, WithoutViewIsRefused) {
    GltfBuilder b;
    b.push("nodes", {{"camera", 0}});
    b.add_perspective_camera();
    EXPECT_EQ(refusal(b), "");
    expect_refused(b, {{"/cameras/0/perspective/yfov", 0, "cameras[0]: yfov 0"},
                       {"/cameras/0/perspective/yfov", kRemoved, "cameras[0].perspective: has no 'yfov'"},
                       {"/cameras/0/type", "orthographic", "cameras[0]: has no 'orthographic'"},
                       {"/cameras/0/type", "panorama", "cameras[0]: type 'panorama'"}});
}

}  // namespace
}  // namespace halflight
