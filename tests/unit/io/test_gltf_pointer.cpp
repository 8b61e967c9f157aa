// Tests KHR_animation_pointer: materials, lights, cameras and nodes that pointers animate.
#include <cmath>

#include "tests/unit/io/gltf_builder.h"

namespace halflight {
namespace {

using GltfPointer = GltfTest;

/// Returns a triangle with a textured material, a point light, a spot light, a perspective and an orthographic camera,
/// on nodes 0 to 4 in this order.
GltfBuilder everything() {
    GltfBuilder b;
    b.add_triangle()["material"] = b.push("materials", {{"emissiveFactor", {0, 0, 0}}});
    b.json["extensionsUsed"] = {"KHR_animation_pointer", "KHR_lights_punctual"};
    b.json["extensionsRequired"] = {"KHR_animation_pointer"};
    b.json["extensions"]["KHR_lights_punctual"]["lights"] = {{{"type", "point"}},
                                                             {{"type", "spot"}, {"spot", {{"outerConeAngle", 0.5}}}}};
    for (const int light : {0, 1}) b.push("nodes", {{"extensions", {{"KHR_lights_punctual", {{"light", light}}}}}});
    b.add_perspective_camera();
    b.push("cameras",
           {{"type", "orthographic"}, {"orthographic", {{"xmag", 1}, {"ymag", 1}, {"znear", 0.1}, {"zfar", 9}}}});
    for (const int camera : {0, 1}) b.push("nodes", {{"camera", camera}});
    b.push("animations", {{"channels", Json::array()}, {"samplers", Json::array()}});
    return b;
}

/// Adds a texture of one white texel; returns its index.
int white_texture(GltfBuilder& b) {
    const char* const uri =
        "data:image/png;base64,"
        "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAIAAACQd1PeAAAADElEQVR4nGP4//8/AAX+Av4N70a4AAAAAElFTkSuQmCC";
    return b.push("textures", {{"source", b.push("images", {{"uri", uri}})}});
}

/// Adds a channel with keys at 0 and 1 s.
void point(GltfBuilder& b, const Json& pointer, const char* type, const std::vector<float>& values) {
    Json& animation = b.json["animations"][0];
    const std::size_t sampler = animation["samplers"].size();
    animation["samplers"].push_back({{"input", b.floats("SCALAR", {0, 1})}, {"output", b.floats(type, values)}});
    const Json extension = {{"KHR_animation_pointer", {{"pointer", pointer}}}};
    animation["channels"].push_back(
        {{"sampler", sampler}, {"target", {{"path", "pointer"}, {"extensions", extension}}}});
}

GltfBuilder with(const Json& pointer, const char* type, const std::vector<float>& values) {
    GltfBuilder b = everything();
    point(b, pointer, type, values);
    return b;
}

/// tests/unit/scene/test_material_properties.cpp animates every property and texture of materials.
TEST_F(GltfPointer, DrivesMaterials) {
    GltfBuilder b = everything();
    b.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = {{"index", white_texture(b)}};
    const std::string transform =
        "/materials/0/pbrMetallicRoughness/baseColorTexture/extensions/KHR_texture_transform/";
    point(b, transform + "offset", "VEC2", {0, 0, 1, 0.5f});
    point(b, transform + "scale", "VEC2", {1, 1, 3, 2});
    point(b, "/materials/0/pbrMetallicRoughness/metallicFactor", "SCALAR", {0, 1});
    point(b, "/materials/0/emissiveFactor", "VEC3", {0, 0, 0, 1, 0.5f, 0});
    point(b, "/materials/0/extensions/KHR_materials_emissive_strength/emissiveStrength", "SCALAR", {2, 6});
    GltfScene scene = open(b);
    EXPECT_TRUE(scene.surfaces_move(kFirst));
    Scene posed = scene.at(0.5, kFirst);
    EXPECT_EQ(posed.materials.at(0).metallic, 0.5f);
    EXPECT_EQ(posed.materials[0].emission, vec3(2, 1, 0)) << "half of the colour, four times as strong";
    EXPECT_EQ(posed.materials[0].base_color_texture.uv_transform, glm::mat3x2(2, 0, 0, 1.5f, 0.5f, 0.25f));
    EXPECT_EQ(posed.materials[0].base_color_texture.image, 0);
    scene.pose(posed, 0.25, kFirst);
    EXPECT_EQ(posed.materials.at(0).base_color_texture.uv_transform, glm::mat3x2(1.5f, 0, 0, 1.25f, 0.25f, 0.125f));
    EXPECT_EQ(posed.materials[0].base_color_texture.image, 0);
    const Scene rest = scene.at(0.5, {});
    EXPECT_EQ(rest.materials.at(0).emission, vec3(0)) << "and at rest again";
    EXPECT_EQ(rest.materials[0].metallic, 1);
    EXPECT_EQ(rest.materials[0].base_color_texture.uv_transform, TextureRef().uv_transform);
}

TEST_F(GltfPointer, NumbersBeyondTheirRangesAreClampedWithAWarning) {
    GltfScene scene =
        open(with("/materials/0/extensions/KHR_materials_transmission/transmissionFactor", "SCALAR", {0, 4}));
    EXPECT_EQ(scene.at(0.125, kFirst).materials.at(0).transmission, 0.5f);
    const Scene half = scene.at(0.5, kFirst);
    EXPECT_EQ(half.materials.at(0).transmission, 1);
    expect_warnings(half.report.warnings, {"materials[0]: transmissionFactor "});
}

TEST_F(GltfPointer, AnIndexOfRefractionOfZeroStays) {
    const std::string pointer = "/materials/0/extensions/KHR_materials_ior/ior";
    GltfBuilder b = with(pointer, "SCALAR", {1, 2});
    EXPECT_EQ(open(b).at(0.5, kFirst).materials.at(0).ior, 1.5f);
    b.json["materials"][0]["extensions"]["KHR_materials_ior"]["ior"] = 0;
    GltfScene scene = open(b);
    EXPECT_EQ(scene.animation_warnings().size(), 1u);
    EXPECT_EQ(scene.at(0.5, kFirst).materials.at(0).ior, kInfiniteIor);
}

TEST_F(GltfPointer, TangentsFollowDrivenTextures) {
    for (const char* path : {"/normalTexture", "/extensions/KHR_materials_anisotropy/anisotropyTexture"}) {
        SCOPED_TRACE(path);
        GltfBuilder b = everything();
        b.primitive()["attributes"]["TEXCOORD_0"] = b.floats("VEC2", {0, 1, 1, 1, 0, 0});
        const std::string texture = std::string("/materials/0") + path;
        b.put(texture, {{"index", white_texture(b)}});
        const float quarter = static_cast<float>(kPi / 2);
        point(b, texture + "/extensions/KHR_texture_transform/rotation", "SCALAR", {0, quarter});
        GltfScene scene = open(b);
        const auto tangent = [&](double seconds, GltfScene::Playing playing) {
            return vec3(scene.at(seconds, playing).meshes.at(0).tangents.at(0));
        };
        EXPECT_LT(glm::distance(tangent(0, {}), vec3(1, 0, 0)), 1e-6f);
        EXPECT_LT(glm::distance(tangent(0, kFirst), vec3(1, 0, 0)), 1e-6f);
        EXPECT_LT(glm::distance(tangent(1, kFirst), vec3(0, -1, 0)), 1e-6f) << "u grows where v did";
        EXPECT_LT(glm::distance(tangent(0.5, {}), vec3(1, 0, 0)), 1e-6f) << "at rest again";
        EXPECT_FALSE(scene.at(1, kFirst).meshes.at(0).deforms);
    }
}

TEST_F(GltfPointer, DrivesSpecularGlossiness) {
    const std::string glossy = "/materials/0/extensions/KHR_materials_pbrSpecularGlossiness/";
    GltfBuilder b = everything();
    b.json["materials"][0]["extensions"]["KHR_materials_pbrSpecularGlossiness"] = Json::object();
    point(b, glossy + "diffuseFactor", "VEC4", {0, 0, 0, 1, 1, 0.5f, 0, 1});
    point(b, glossy + "specularFactor", "VEC3", {0, 0, 0, 0.04f, 0.08f, 0});
    point(b, glossy + "glossinessFactor", "SCALAR", {0, 0.5f});
    GltfScene scene = open(b);
    const Material half = scene.at(0.5, kFirst).materials.at(0), rest = scene.at(0, {}).materials.at(0);
    EXPECT_EQ(half.base_color, vec4(0.5f, 0.25f, 0, 1));
    EXPECT_LT(glm::distance(half.specular_color, vec3(0.5f, 1, 0)), 1e-6f);
    EXPECT_EQ(half.roughness, 0.75f);
    EXPECT_EQ(rest.base_color, vec4(1));
    EXPECT_EQ(rest.roughness, 0);

    // Glossiness with a texture becomes a roughness image. The transform of that texture is still animated.
    b.json["materials"][0]["extensions"]["KHR_materials_pbrSpecularGlossiness"]["specularGlossinessTexture"] = {
        {"index", white_texture(b)}};
    point(b, glossy + "specularGlossinessTexture/extensions/KHR_texture_transform/offset", "VEC2", {0, 0, 1, 1});
    GltfScene textured = open(b);
    expect_warnings(textured.animation_warnings(), {"animations[0].channels[2]: "});
    const Scene posed = textured.at(0.5, kFirst);
    const Material& m = posed.materials.at(0);
    EXPECT_EQ(m.roughness, 1);
    EXPECT_EQ(m.metallic_roughness_texture.image, 1);
    EXPECT_EQ(posed.images.size(), 2u);
    EXPECT_EQ(m.specular_color_texture.uv_transform[2], vec2(0.5f));
    EXPECT_EQ(m.metallic_roughness_texture.uv_transform[2], vec2(0.5f));
}

TEST_F(GltfPointer, DrivesLights) {
    GltfBuilder b = everything();
    const std::string lights = "/extensions/KHR_lights_punctual/lights/";
    point(b, lights + "0/color", "VEC3", {1, 1, 1, 0, 0.5f, 1});
    point(b, lights + "0/intensity", "SCALAR", {0, 8});
    point(b, lights + "1/spot/innerConeAngle", "SCALAR", {0, 0.25f});
    point(b, lights + "1/spot/outerConeAngle", "SCALAR", {0.5f, 1});
    GltfScene scene = open(b);
    EXPECT_TRUE(scene.surfaces_move(kFirst));
    const Scene half = scene.at(0.5, kFirst);
    EXPECT_EQ(half.lights.at(0).intensity, vec3(2, 3, 4));
    EXPECT_EQ(half.lights.at(1).inner_cone, 0.125f);
    EXPECT_EQ(half.lights.at(1).outer_cone, 0.75f);
    EXPECT_EQ(half.lights.at(1).intensity, vec3(1));
    EXPECT_EQ(scene.at(0, {}).lights.at(0).intensity, vec3(1));
    EXPECT_EQ(scene.at(0, {}).lights.at(1).outer_cone, 0.5f);
}

TEST_F(GltfPointer, DrivesCameras) {
    GltfBuilder b = with("/cameras/1/orthographic/ymag", "SCALAR", {0, 4});
    point(b, "/cameras/1/orthographic/xmag", "SCALAR", {0, 8});
    point(b, "/cameras/1/orthographic/znear", "SCALAR", {0, 1});
    point(b, "/cameras/1/orthographic/zfar", "SCALAR", {10, 20});
    point(b, "/cameras/0/perspective/yfov", "SCALAR", {0.5f, 1.5f});
    point(b, "/cameras/0/perspective/znear", "SCALAR", {0, 2});
    point(b, "/cameras/0/perspective/zfar", "SCALAR", {20, 40});
    point(b, "/cameras/0/perspective/aspectRatio", "SCALAR", {1, 3});
    GltfScene scene = open(b);
    EXPECT_FALSE(scene.surfaces_move(kFirst)) << "cameras alone";
    const auto numbers = [](const std::vector<Camera>& cameras) {
        const Camera &p = cameras.at(0), &o = cameras.at(1);
        return std::vector<double>{p.vertical_fov, p.near_plane, p.far_plane, p.aspect,
                                   o.ortho_height, o.near_plane, o.far_plane, o.aspect};
    };
    EXPECT_EQ(numbers(scene.cameras_at(0.5, kFirst)), (std::vector<double>{1, 1, 30, 2, 4, 0.5, 15, 2}));
    EXPECT_EQ(numbers(scene.at(0.5, kFirst).cameras), numbers(scene.cameras_at(0.5, kFirst)));
    EXPECT_EQ(numbers(scene.cameras_at(0.5, {})), (std::vector<double>{1, 0.1, 0, 0, 2, 0.1, 9, 1})) << "0: infinite";
    EXPECT_EQ(without_name(error_message([&] { scene.at(0, kFirst); })), "cameras[1]: xmag and ymag must not be zero");
    EXPECT_TRUE(refusal_in_motion(with("/cameras/0/perspective/yfov", "SCALAR", {4, 4})).starts_with("cameras[0]: "));
}

TEST_F(GltfPointer, DrivesWeightsOfMeshesForNodesWithoutTheirOwn) {
    GltfBuilder b = with("/meshes/0/weights", "SCALAR", {0, 1});
    const int up = b.floats("VEC3", {0, 2, 0, 0, 2, 0, 0, 2, 0});
    b.json["meshes"][0]["primitives"][0]["targets"] = {{{"POSITION", up}}};
    b.push("nodes", {{"mesh", 0}, {"weights", {0.25}}});
    GltfScene scene = open(b);
    EXPECT_TRUE(scene.surfaces_move(kFirst));
    const Scene half = scene.at(0.5, kFirst);
    ASSERT_EQ(half.meshes.size(), 2u);
    EXPECT_EQ(half.meshes[0].positions.at(0), vec3(0, 1, 0));
    EXPECT_TRUE(half.meshes[0].deforms);
    EXPECT_EQ(half.meshes[1].positions.at(0), vec3(0, 0.5f, 0));
    EXPECT_FALSE(half.meshes[1].deforms);
    EXPECT_EQ(scene.at(0.5, {}).meshes.at(0).positions.at(0), vec3(0));
}

TEST_F(GltfPointer, DrivesNodesLikeTheirOwnPaths) {
    GltfBuilder b = with("/nodes/0/translation", "VEC3", {0, 0, 0, 2, 0, 0});
    point(b, "/nodes/0/scale", "VEC3", {1, 1, 1, 3, 3, 3});
    const float s = std::sqrt(0.5f);
    point(b, "/nodes/0/rotation", "VEC4", {0, 0, 0, 1, 0, 0, s, s});
    const dmat4 found = open(b).at(0.5, kFirst).instances.at(0).object_to_world;
    EXPECT_EQ(found[3], dvec4(1, 0, 0, 1));
    EXPECT_LT(glm::distance(found[0], 2.0 * dvec4(std::sqrt(0.5), std::sqrt(0.5), 0, 0)), 1e-6) << "by the arc";

    GltfBuilder morphed = with("/nodes/0/weights", "SCALAR", {0, 1});
    const int up = morphed.floats("VEC3", {0, 2, 0, 0, 2, 0, 0, 2, 0});
    morphed.json["meshes"][0]["primitives"][0]["targets"] = {{{"POSITION", up}}};
    EXPECT_EQ(open(morphed).at(0.5, kFirst).meshes.at(0).positions.at(0), vec3(0, 1, 0));
}

TEST_F(GltfPointer, UnknownPointersAreIgnoredWithAWarning) {
    GltfBuilder b = with("/extensions/KHR_lights_punctual/lights/0/range", "SCALAR", {0, 1});
    point(b, "/scenes/0/extras/mood", "SCALAR", {0, 1});
    point(b, "/cameras/0/perspective/yfov", "SCALAR", {0.5f, 1.5f});
    GltfScene scene = open(b);
    EXPECT_EQ(scene.animations().at(0).channels.size(), 1u);
    expect_warnings(scene.animation_warnings(), {"animations[0].channels[0]: drives '/extensions/KHR_lights_punctual/",
                                                 "animations[0].channels[1]: drives '/scenes/0/extras/mood'"});
    EXPECT_TRUE(scene.at(0, kFirst).report.warnings.empty()) << "the extension is known";
}

TEST_F(GltfPointer, MalformedPointersAreRefused) {
    const std::pair<Json, const char*> cases[] = {
        {"materials/0/emissiveFactor", ": 'materials/0/emissiveFactor' is no JSON pointer"},
        {"", ": '' is no JSON pointer"},
        {"/materials/1/emissiveFactor", ": pointer '/materials/1/emissiveFactor': '1' is not an index"},
        {"/materials/-1/emissiveFactor", ": pointer '/materials/-1/emissiveFactor': "},
        {"/materials/00/emissiveFactor", ": pointer '/materials/00/emissiveFactor': "},
        {"/materials/0x/emissiveFactor", ": pointer '/materials/0x/emissiveFactor': "},
        {"/materials//emissiveFactor", ": pointer '/materials//emissiveFactor': "},
        {"/materials/99999999999999999999/emissiveFactor", ": pointer '/materials/99999999999999999999/"},
        {"/nodes/5", ": pointer '/nodes/5': "},
        {"/extensions/KHR_lights_punctual/lights/0/spot/outerConeAngle", ": drives a cone of lights[0]"},
        {"/cameras/1/perspective/yfov", ": drives yfov of cameras[1]"},
        {"/cameras/0/orthographic/ymag", ": drives ymag of cameras[0]"},
        {"/meshes/0/weights", ": drives weights of meshes[0]"},
        {"/materials/0/extensions/KHR_materials_pbrSpecularGlossiness/glossinessFactor",
         ": drives KHR_materials_pbrSpecularGlossiness of materials[0]"},
        {"/nodes/0/weights", ": drives weights of nodes[0]"},
        {7, ".target.extensions.KHR_animation_pointer.pointer: "},
    };
    const std::string first = "animations[0].channels[0]";
    for (const auto& [pointer, message] : cases) {
        const GltfBuilder b = with(pointer, "SCALAR", {0, 1});
        EXPECT_TRUE(refusal_in_motion(b).starts_with(first + message)) << refusal_in_motion(b);
        EXPECT_NO_THROW(load(b)) << "at rest: " << pointer;
    }
    GltfBuilder without = with("/nodes/0/scale", "VEC3", {1, 1, 1, 2, 2, 2});
    without.json["animations"][0]["channels"][0]["target"].erase("extensions");
    EXPECT_TRUE(refusal_in_motion(without).starts_with(first + ": "));
    EXPECT_TRUE(refusal_in_motion(with("/nodes/0/scale", "SCALAR", {1, 2})).starts_with("accessors[2]: "));
}

/// Adds a channel that switches the visibility of a node at the times 0, 1, 2, ...
void switch_node(GltfBuilder& b, int node, const std::vector<std::uint8_t>& visible,
                 const char* interpolation = "STEP") {
    std::vector<float> times;
    for (std::size_t i = 0; i < visible.size(); ++i) times.push_back(static_cast<float>(i));
    const Json extension = {
        {"KHR_animation_pointer",
         {{"pointer", "/nodes/" + std::to_string(node) + "/extensions/KHR_node_visibility/visible"}}}};
    b.push("animations",
           {{"channels", {{{"sampler", 0}, {"target", {{"path", "pointer"}, {"extensions", extension}}}}}},
            {"samplers",
             {{{"input", b.floats("SCALAR", times)},
               {"output", b.accessor("SCALAR", kU8, visible)},
               {"interpolation", interpolation}}}}});
}

/// A parent (1) with a child (0) that has a mesh, a light (2) and a camera (3) below the child.
GltfBuilder family(bool visible) {
    GltfBuilder b;
    b.add_triangle();
    b.json["nodes"][0]["translation"] = {1, 2, 3};
    b.json["nodes"][0]["children"] = {2, 3};
    b.push("nodes", {{"children", {0}}, {"extensions", {{"KHR_node_visibility", {{"visible", visible}}}}}});
    b.json["extensions"]["KHR_lights_punctual"]["lights"] = {{{"type", "point"}}};
    b.push("nodes", {{"extensions", {{"KHR_lights_punctual", {{"light", 0}}}}}});
    b.add_perspective_camera();
    b.push("nodes", {{"camera", 0}});
    b.require({"KHR_animation_pointer", "KHR_lights_punctual", "KHR_node_visibility"});
    return b;
}

TEST_F(GltfPointer, SwitchesVisibility) {
    for (const bool at_rest : {true, false}) {
        GltfBuilder b = family(at_rest);
        switch_node(b, 1, {0, 1, 0});
        GltfScene file = open(b);
        EXPECT_TRUE(file.surfaces_move(kFirst) && file.parts_come_and_go(kFirst));
        EXPECT_TRUE(file.camera_cuts(0, kFirst).empty());
        for (const double seconds : {-1.0, 0.5, 1.0, 1.75, 2.0, 9.0}) {
            const bool visible = seconds >= 1 && seconds < 2;
            const Scene scene = file.at(seconds, kFirst);
            // Objects keep their numbers and names. Hidden ones have no area, and no light.
            ASSERT_TRUE(scene.instances.size() == 1 && scene.lights.size() == 1 && scene.cameras.size() == 1);
            EXPECT_EQ(scene.instances[0].object_to_world[0].x, visible ? 1 : 0) << seconds;
            EXPECT_EQ(scene.instances[0].object_to_world[3], dvec4(1, 2, 3, 1));
            EXPECT_EQ(scene.meshes.at(0).triangles.size(), visible ? 1u : 0u);
            EXPECT_EQ(scene.lights[0].intensity, vec3(visible ? 1 : 0));
            EXPECT_EQ(scene.cameras[0].camera_to_world[3], dvec4(1, 2, 3, 1));
        }
        const Scene rest = file.at_rest();
        EXPECT_EQ(rest.meshes.at(0).triangles.size(), at_rest ? 1u : 0u);
        EXPECT_EQ(rest.lights.at(0).intensity, vec3(at_rest ? 1 : 0));
        EXPECT_TRUE(rest.report.warnings.empty());
    }
    // A node above that hides for good takes the child out; a node below may be switched on its own.
    GltfBuilder b = family(false);
    switch_node(b, 0, {1, 1});
    EXPECT_TRUE(open(b).at(0.5, kFirst).instances.empty());
    b = family(true);
    switch_node(b, 0, {0, 1});
    EXPECT_TRUE(open(b).at(0.5, kFirst).meshes.at(0).triangles.empty());
    EXPECT_FALSE(open(b).at(1, kFirst).meshes.at(0).triangles.empty());
}

TEST_F(GltfPointer, SwitchesSkinsAndInstancesAndLeavesJoints) {
    GltfBuilder b;
    const int positions = b.floats("VEC3", {0, 0, 0, 1, 0, 0, 0, 1, 0});
    const int joints = b.accessor("VEC4", kU8, std::vector<std::uint8_t>(12));
    const int weights = b.floats("VEC4", {1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0});
    b.add_mesh({{"POSITION", positions}, {"JOINTS_0", joints}, {"WEIGHTS_0", weights}});
    b.json["nodes"][0]["skin"] = b.push("skins", {{"joints", {1}}});
    b.push("nodes", Json::object());
    b.push("nodes", {{"mesh", 0}});
    b.json["nodes"][2]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"]["TRANSLATION"] =
        b.floats("VEC3", {0, 0, 0, 4, 0, 0});
    b.require({"KHR_animation_pointer", "KHR_node_visibility", "EXT_mesh_gpu_instancing"});
    const auto shown = [&](int node) {
        GltfBuilder own = b;
        switch_node(own, node, {0, 0});
        std::vector<bool> areas;
        for (const Instance& instance : open(own).at(0.5, kFirst).instances)
            areas.push_back(instance.object_to_world[0].x != 0);
        return areas;
    };
    EXPECT_EQ(shown(0), (std::vector<bool>{false, true, true}));
    EXPECT_EQ(shown(1), (std::vector<bool>{true, true, true})) << "a joint moves a skin, whether it is shown or not";
    EXPECT_EQ(shown(2), (std::vector<bool>{true, false, false}));
}

TEST_F(GltfPointer, VisibilityIsNotInterpolated) {
    GltfBuilder b = family(true);
    switch_node(b, 1, {1, 0}, "LINEAR");
    GltfScene file = open(b);
    EXPECT_FALSE(file.at(0.9, kFirst).meshes.at(0).triangles.empty());
    expect_warnings(file.animation_warnings(), {"animations[0].samplers[0]: interpolates visibility"});
    b = family(true);
    switch_node(b, 1, {1, 1, 1, 0, 0, 0}, "CUBICSPLINE");
    b.json["accessors"][b.json["animations"][0]["samplers"][0]["input"].get<int>()]["count"] = 2;
    EXPECT_TRUE(refusal_in_motion(b).starts_with("animations[0].samplers[0]: interpolates visibility"));
}

/// Values of the file itself are faults, whether an animation drives them or not.
TEST_F(GltfPointer, StrictOptionsTakeAnimatedValuesOutOfRange) {
    const std::vector<std::size_t> all{0};
    const GltfOptions strict{.strict = true};
    GltfBuilder b = everything();
    b.json["materials"][0]["pbrMetallicRoughness"]["metallicFactor"] = 1;
    point(b, "/materials/0/pbrMetallicRoughness/metallicFactor", "SCALAR", {0, 2});
    GltfScene scene(write("scene.glb", b.glb()), strict);
    EXPECT_EQ(scene.at(0.25, all).materials.at(0).metallic, 0.5f);
    const Scene beyond = scene.at(1, all);
    EXPECT_EQ(beyond.materials.at(0).metallic, 1.0f);
    EXPECT_FALSE(beyond.report.warnings.empty());
    b.json["materials"][0]["pbrMetallicRoughness"]["metallicFactor"] = 2;
    GltfScene faulty(write("scene.glb", b.glb()), strict);
    EXPECT_NE(error_message([&] { faulty.at(0.25, all); }), "");
}

}  // namespace
}  // namespace halflight
