// KHR_animation_pointer: materials, lights, cameras and nodes that are driven by pointers.
#include <cmath>

#include "tests/unit/gltf_builder.h"

namespace halflight {
namespace {

constexpr std::size_t kFirst[] = {0};

class GltfPointer : public GltfTest {
  protected:
    GltfScene open(const GltfBuilder& builder) const { return GltfScene(write("scene.glb", builder.glb())); }
    std::string refusal_in_motion(const GltfBuilder& builder) const {
        return without_name(error_message([&] { open(builder).at(0.5, kFirst); }));
    }
};

/// A triangle of a textured material, a point light, a spot light, a perspective and an orthographic camera; the nodes
/// 0 to 4, in this order.
GltfBuilder everything() {
    GltfBuilder b;
    b.add_triangle()["material"] = b.push("materials", {{"emissiveFactor", {0, 0, 0}}});
    b.json["extensionsUsed"] = {"KHR_animation_pointer", "KHR_lights_punctual"};
    b.json["extensionsRequired"] = {"KHR_animation_pointer"};
    b.json["extensions"]["KHR_lights_punctual"]["lights"] = {{{"type", "point"}},
                                                             {{"type", "spot"}, {"spot", {{"outerConeAngle", 0.5}}}}};
    for (const int light : {0, 1}) b.push("nodes", {{"extensions", {{"KHR_lights_punctual", {{"light", light}}}}}});
    b.push("cameras", {{"type", "perspective"}, {"perspective", {{"yfov", 1}, {"znear", 0.1}}}});
    b.push("cameras",
           {{"type", "orthographic"}, {"orthographic", {{"xmag", 1}, {"ymag", 1}, {"znear", 0.1}, {"zfar", 9}}}});
    for (const int camera : {0, 1}) b.push("nodes", {{"camera", camera}});
    b.push("animations", {{"channels", Json::array()}, {"samplers", Json::array()}});
    return b;
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

TEST_F(GltfPointer, DrivesMaterials) {
    GltfBuilder b = everything();
    point(b, "/materials/0/pbrMetallicRoughness/baseColorFactor", "VEC4", {0, 0, 0, 1, 1, 0.5f, 0.25f, 0});
    point(b, "/materials/0/pbrMetallicRoughness/metallicFactor", "SCALAR", {0, 1});
    point(b, "/materials/0/pbrMetallicRoughness/roughnessFactor", "SCALAR", {1, 0});
    point(b, "/materials/0/emissiveFactor", "VEC3", {0, 0, 0, 1, 0.5f, 0});
    point(b, "/materials/0/extensions/KHR_materials_emissive_strength/emissiveStrength", "SCALAR", {2, 6});
    GltfScene scene = open(b);
    EXPECT_TRUE(scene.surfaces_move(kFirst));
    const Scene half = scene.at(0.5, kFirst);
    const Material& m = half.materials.at(0);
    EXPECT_EQ(m.base_color, vec4(0.5f, 0.25f, 0.125f, 0.5f));
    EXPECT_EQ(m.metallic, 0.5f);
    EXPECT_EQ(m.roughness, 0.5f);
    EXPECT_EQ(m.emission, vec3(2, 1, 0)) << "half of the colour, four times as strong";
    EXPECT_EQ(scene.at(1, kFirst).materials.at(0).emission, vec3(6, 3, 0));
    const Scene rest = scene.at(0.5, {});
    EXPECT_EQ(rest.materials.at(0).base_color, vec4(1)) << "and at rest again";
    EXPECT_EQ(rest.materials.at(0).emission, vec3(0));
    EXPECT_EQ(rest.materials.at(0).metallic, 1);
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
    GltfScene scene = open(with("/cameras/0/perspective/yfov", "SCALAR", {0.5f, 1.5f}));
    EXPECT_FALSE(scene.surfaces_move(kFirst)) << "a camera alone";
    EXPECT_DOUBLE_EQ(scene.cameras_at(0.25, kFirst).at(0).vertical_fov, 0.75);
    EXPECT_DOUBLE_EQ(scene.at(0.25, kFirst).cameras.at(0).vertical_fov, 0.75);
    EXPECT_DOUBLE_EQ(scene.cameras_at(0.25, {}).at(0).vertical_fov, 1);
    EXPECT_EQ(refusal_in_motion(with("/cameras/0/perspective/yfov", "SCALAR", {4, 4})),
              "cameras[0]: yfov 4 is not between 0 and pi");
}

TEST_F(GltfPointer, DrivesNodesAsTheirOwnPathsDo) {
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

TEST_F(GltfPointer, UnknownOnesAreLeftOutWithAWarning) {
    GltfBuilder b = with("/materials/0/alphaCutoff", "SCALAR", {0, 1});
    point(b, "/scenes/0/extras/mood", "SCALAR", {0, 1});
    point(b, "/cameras/0/perspective/yfov", "SCALAR", {0.5f, 1.5f});
    GltfScene scene = open(b);
    EXPECT_EQ(scene.animations().at(0).channels.size(), 1u);
    EXPECT_EQ(
        scene.animation_warnings(),
        (std::vector<std::string>{
            "animations[0].channels[0]: drives '/materials/0/alphaCutoff', which is not supported; it is left out",
            "animations[0].channels[1]: drives '/scenes/0/extras/mood', which is not supported; it is left out"}));
    EXPECT_TRUE(scene.at(0, kFirst).report.warnings.empty()) << "the extension is known";
}

TEST_F(GltfPointer, MalformedOnesAreRefused) {
    const std::string first = "animations[0].channels[0]";
    const auto refused = [&](const Json& pointer, const std::string& message) {
        const GltfBuilder b = with(pointer, "SCALAR", {0, 1});
        EXPECT_EQ(refusal_in_motion(b), first + message);
        EXPECT_NO_THROW(load(b)) << "at rest";
    };
    refused("materials/0/emissiveFactor", ": 'materials/0/emissiveFactor' is no JSON pointer");
    refused("", ": '' is no JSON pointer");
    for (const char* index : {"1", "-1", "00", "0x", "", "99999999999999999999"})
        refused(
            fmt::format("/materials/{}/emissiveFactor", index),
            fmt::format(": pointer '/materials/{0}/emissiveFactor': '{0}' is not an index into a list of 1", index));
    refused("/nodes/5", ": pointer '/nodes/5': '5' is not an index into a list of 5");
    refused("/extensions/KHR_lights_punctual/lights/0/spot/outerConeAngle",
            ": drives a cone of lights[0], which is no spot");
    refused("/cameras/1/perspective/yfov", ": drives yfov of cameras[1], which is not perspective");
    refused("/nodes/0/weights", ": drives weights of nodes[0], which has no morph targets");
    refused(7, ".target.extensions.KHR_animation_pointer.pointer: is not a string");

    GltfBuilder without = with("/nodes/0/scale", "VEC3", {1, 1, 1, 2, 2, 2});
    without.json["animations"][0]["channels"][0]["target"].erase("extensions");
    EXPECT_EQ(refusal_in_motion(without), first + ": has no KHR_animation_pointer to say what it drives");
    EXPECT_EQ(refusal_in_motion(with("/nodes/0/scale", "SCALAR", {1, 2})),
              "accessors[2]: has 1 components, animations[0].samplers[0].output needs 3");
}

}  // namespace
}  // namespace halflight
