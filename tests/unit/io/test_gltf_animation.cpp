// Tests animations of glTF files and the poses that they produce.
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <limits>
#include <utility>

#include "engine/io/files.h"
#include "engine/io/png.h"
#include "engine/scene/geometry.h"
#include "tests/unit/io/gltf_builder.h"

namespace halflight {
namespace {

class GltfAnimation : public GltfTest {
  protected:
    /// Replaces the file. Scenes that were opened before keep reading the file that they opened.
    GltfScene open(const GltfBuilder& builder) const {
        std::filesystem::remove(folder_ / "scene.glb");
        return GltfScene(write("scene.glb", builder.glb()));
    }
    /// Returns the error message of opening the file, reading its animations, and posing it by the first one at 0.5 s.
    std::string refusal_in_motion(const GltfBuilder& builder) const {
        return without_name(error_message([&] { open(builder).at(0.5, kFirst); }));
    }

    static constexpr std::size_t kFirst[] = {0};
};

/// Adds an animation with one channel; returns it.
Json& animate(GltfBuilder& b, int node, const char* path, const char* interpolation, int input, int output) {
    b.push("animations", {{"channels", {{{"sampler", 0}, {"target", {{"node", node}, {"path", path}}}}}},
                          {"samplers", {{{"input", input}, {"output", output}, {"interpolation", interpolation}}}}});
    return b.json["animations"].back();
}

/// Returns a triangle that moves from x = 0 to x = 2 in one second.
GltfBuilder moving() {
    GltfBuilder b;
    b.add_triangle();
    const int times = b.floats("SCALAR", {0, 1});
    animate(b, 0, "translation", "LINEAR", times, b.floats("VEC3", {0, 0, 0, 2, 0, 0}))["name"] = "slide";
    return b;
}

TEST_F(GltfAnimation, ListsTheAnimationsOfTheFile) {
    GltfBuilder b = moving();
    b.push("animations", {{"channels", Json::array()}, {"samplers", Json::array()}});
    GltfScene scene = open(b);
    ASSERT_EQ(scene.animations().size(), 2u);
    EXPECT_EQ(scene.animations()[0].name, "slide");
    EXPECT_EQ(scene.animations()[0].channels.size(), 1u);
    EXPECT_EQ(scene.animations()[0].end, 1);
    EXPECT_EQ(scene.animations()[1].end, 0);
    EXPECT_TRUE(open(GltfBuilder()).animations().empty());
}

TEST_F(GltfAnimation, MovesTurnsAndScalesNodes) {
    GltfBuilder b = moving();
    b.json["nodes"][0]["translation"] = {9, 9, 9};
    GltfScene scene = open(b);
    EXPECT_EQ(scene.at(0.25, {}).instances.at(0).object_to_world[3], dvec4(9, 9, 9, 1)) << "at rest";
    EXPECT_EQ(scene.at(0.25, kFirst).instances.at(0).object_to_world[3], dvec4(0.5, 0, 0, 1));
    EXPECT_EQ(scene.at(7, kFirst).instances.at(0).object_to_world[3], dvec4(2, 0, 0, 1));
    EXPECT_EQ(scene.at(-7, kFirst).instances.at(0).object_to_world[3], dvec4(0, 0, 0, 1));
    EXPECT_EQ(scene.at(0, {}).instances.at(0).object_to_world[3], dvec4(9, 9, 9, 1)) << "and at rest again";
    scene.at(1, kFirst);
    EXPECT_EQ(scene.at_rest().instances.at(0).object_to_world[3], dvec4(9, 9, 9, 1)) << "and so";

    // The keys are a rotation by 90 degrees as normalized shorts, and a scale of two.
    const int times = b.floats("SCALAR", {0, 1});
    const std::vector<std::int16_t> quarter = {0, 0, 0, 32767, 0, 0, 23170, 23170};
    animate(b, 0, "rotation", "LINEAR", times, b.accessor("VEC4", kI16, quarter, true));
    animate(b, 0, "scale", "STEP", times, b.floats("VEC3", {1, 1, 1, 2, 2, 2}));
    const std::size_t all[] = {0, 1, 2};
    const dmat4 found = open(b).at(1, all).instances.at(0).object_to_world;
    const dmat4 expected =
        glm::scale(glm::rotate(glm::translate(dmat4(1), dvec3(2, 0, 0)), kPi / 2, dvec3(0, 0, 1)), dvec3(2));
    for (int column = 0; column < 4; ++column)
        EXPECT_LT(glm::distance(found[column], expected[column]), 1e-6) << column;
}

TEST_F(GltfAnimation, PosesDoNotDependOnEarlierPoses) {
    GltfScene scene = open(moving());
    const dmat4 first = scene.at(0.3, kFirst).instances.at(0).object_to_world;
    for (const double seconds : {0.9, -1.0, 0.0}) scene.at(seconds, kFirst);
    EXPECT_EQ(scene.at(0.3, kFirst).instances.at(0).object_to_world, first);
}

TEST_F(GltfAnimation, TheLastChannelOfAPropertyCounts) {
    GltfBuilder b = moving();
    animate(b, 0, "translation", "STEP", b.floats("SCALAR", {0}), b.floats("VEC3", {0, 5, 0}));
    GltfScene scene = open(b);
    const std::size_t both[] = {0, 1}, reversed[] = {1, 0};
    EXPECT_EQ(scene.at(1, both).instances.at(0).object_to_world[3], dvec4(0, 5, 0, 1));
    EXPECT_EQ(scene.at(1, reversed).instances.at(0).object_to_world[3], dvec4(2, 0, 0, 1));
}

TEST_F(GltfAnimation, CubicSplineFollowsTheSpecification) {
    GltfBuilder b;
    b.add_triangle();
    // Each row holds in-tangent, value and out-tangent: y = t^2 (3 - t) / 4 from 0 to 2 s.
    const int output = b.floats("VEC3", {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0});
    animate(b, 0, "translation", "CUBICSPLINE", b.floats("SCALAR", {0, 2}), output);
    GltfScene scene = open(b);
    for (const double t : {0.0, 0.5, 1.0, 1.75})
        EXPECT_NEAR(scene.at(t, kFirst).instances.at(0).object_to_world[3].y, t * t * (3 - t) / 4, 1e-15) << t;
}

/// Returns a triangle whose vertices follow joint 0 by JOINTS_0 and joint 1 by JOINTS_1, with equal weights.
GltfBuilder skinned_by_two_sets() {
    GltfBuilder b;
    Json& primitive = b.add_triangle();
    const auto joints = [&](std::uint16_t j) {
        return b.accessor("VEC4", kU16, std::vector<std::uint16_t>{j, 0, 0, 0, j, 0, 0, 0, j, 0, 0, 0});
    };
    const int half = b.accessor("VEC4", kU8, std::vector<std::uint8_t>{255, 0, 0, 0, 255, 0, 0, 0, 255, 0, 0, 0}, true);
    primitive["attributes"]["JOINTS_0"] = joints(0);
    primitive["attributes"]["JOINTS_1"] = joints(1);
    primitive["attributes"]["WEIGHTS_0"] = primitive["attributes"]["WEIGHTS_1"] = half;
    b.json["nodes"][0]["skin"] = 0;
    b.push("nodes", Json::object());
    b.push("nodes", {{"translation", {0, 0, 0}}});
    b.push("skins", {{"joints", {1, 2}}});
    animate(b, 2, "translation", "LINEAR", b.floats("SCALAR", {0, 1}), b.floats("VEC3", {0, 0, 0, 0, 8, 0}));
    return b;
}

TEST_F(GltfAnimation, SkinsFollowTheirJoints) {
    GltfScene scene = open(skinned_by_two_sets());
    EXPECT_TRUE(scene.surfaces_move(kFirst));
    EXPECT_EQ(scene.at(0, kFirst).meshes.at(0).positions, (std::vector<vec3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}));
    EXPECT_EQ(scene.at(1, kFirst).meshes.at(0).positions, (std::vector<vec3>{{0, 4, 0}, {1, 4, 0}, {0, 5, 0}}))
        << "half of the way of one of two joints";
    ASSERT_EQ(scene.deformers().skins.size(), 1u);
    EXPECT_EQ(scene.deformers().skins[0].joints, 2u);
}

/// Returns a mesh with two morph targets; the second one is sparse and moves the last corner only.
GltfBuilder morphed() {
    GltfBuilder b;
    Json& primitive = b.add_triangle();
    const int sparse = b.push("accessors", {{"componentType", kF32}, {"count", 3}, {"type", "VEC3"}});
    b.json["accessors"][static_cast<std::size_t>(sparse)]["sparse"] = {
        {"count", 1},
        {"indices", {{"bufferView", b.view(std::vector<std::uint8_t>{2})}, {"componentType", kU8}}},
        {"values", {{"bufferView", b.view(std::vector<float>{0, 0, 6})}}}};
    const int up = b.floats("VEC3", {0, 2, 0, 0, 2, 0, 0, 2, 0});
    primitive["targets"] = {{{"POSITION", up}}, {{"POSITION", sparse}}};
    b.json["meshes"][0]["weights"] = {0.25, 0};
    const int weights = b.accessor("SCALAR", kU8, std::vector<std::uint8_t>{0, 0, 255, 51}, true);
    animate(b, 0, "weights", "LINEAR", b.floats("SCALAR", {0, 1}), weights);
    return b;
}

TEST_F(GltfAnimation, MorphTargetsFollowTheirWeights) {
    GltfBuilder b = morphed();
    b.push("nodes", {{"mesh", 0}});  // this node uses the default weights
    GltfScene scene = open(b);
    const auto corners = [&](double seconds, GltfScene::Playing playing, std::size_t instance) {
        const Scene s = scene.at(seconds, playing);
        return s.meshes[static_cast<std::size_t>(s.instances.at(instance).mesh)].positions;
    };
    EXPECT_EQ(corners(0, {}, 0), (std::vector<vec3>{{0, 0.5f, 0}, {1, 0.5f, 0}, {0, 1.5f, 0}}));
    EXPECT_EQ(corners(0, kFirst, 0), (std::vector<vec3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}));
    EXPECT_EQ(corners(1, kFirst, 1), corners(0, {}, 0)) << "the other node";
    const std::vector<vec3> half = corners(0.5, kFirst, 0);  // weights 0.5 and 0.1
    EXPECT_EQ(half[1], vec3(1, 1, 0));
    EXPECT_LT(glm::distance(half[2], vec3(0, 2, 0.6f)), 1e-6f);
    ASSERT_EQ(scene.deformers().morphed_meshes.size(), 1u);
    EXPECT_EQ(scene.deformers().morphed_meshes[0].targets, 2u);
}

TEST_F(GltfAnimation, CamerasAndLightsFollowTheirNodes) {
    GltfBuilder b = moving();
    b.json["nodes"][0].erase("mesh");
    b.json["nodes"][0]["camera"] =
        b.push("cameras", {{"type", "perspective"}, {"perspective", {{"yfov", 1}, {"znear", 0.1}}}});
    b.push("nodes", {{"mesh", 0}});
    GltfScene scene = open(b);
    EXPECT_FALSE(scene.surfaces_move(kFirst)) << "a camera alone";
    EXPECT_EQ(scene.cameras_at(0.5, kFirst).at(0).camera_to_world[3], dvec4(1, 0, 0, 1));
    EXPECT_EQ(scene.at(0.5, kFirst).cameras.at(0).camera_to_world, scene.cameras_at(0.5, kFirst)[0].camera_to_world);

    b.json["extensions"]["KHR_lights_punctual"]["lights"] = {{{"type", "point"}}};
    b.push("nodes", {{"extensions", {{"KHR_lights_punctual", {{"light", 0}}}}}});
    b.json["nodes"][0]["children"] = {2};
    GltfScene lit = open(b);
    EXPECT_TRUE(lit.surfaces_move(kFirst)) << "a light below an animated node";
    EXPECT_EQ(lit.at(1, kFirst).lights.at(0).position, dvec3(2, 0, 0));
}

TEST_F(GltfAnimation, TheRestPoseEqualsTheLoadedScene) {
    for (const GltfBuilder& b : {moving(), skinned_by_two_sets(), morphed()}) {
        const Scene loaded = load(b);
        for (const Scene& posed : {open(b).at(3, {}), open(b).at_rest()}) {
            ASSERT_EQ(loaded.meshes.size(), posed.meshes.size());
            EXPECT_EQ(loaded.meshes[0].positions, posed.meshes[0].positions);
            EXPECT_EQ(loaded.instances[0].object_to_world, posed.instances[0].object_to_world);
            EXPECT_EQ(loaded.materials.size(), posed.materials.size());
            EXPECT_EQ(loaded.report.warnings, posed.report.warnings);
        }
    }
}

/// A scale of 0 hides surfaces for a while (glTF 2.0, section 3.5.2). The objects stay, so that edits find them.
TEST_F(GltfAnimation, HiddenSurfacesKeepTheirInstances) {
    GltfBuilder shared;
    shared.add_triangle();
    shared.json["meshes"][0]["name"] = "leaf";
    shared.push("nodes", {{"mesh", 0}, {"name", "shown"}});
    shared.json["nodes"][0]["name"] = "hidden";
    GltfBuilder alone = shared;
    alone.json["nodes"].erase(1);
    alone.json["scenes"] = {{{"nodes", {0}}}};
    for (GltfBuilder b : {shared, alone}) {
        animate(b, 0, "scale", "STEP", b.floats("SCALAR", {0, 1}), b.floats("VEC3", {0, 0, 0, 2, 2, 2}));
        GltfScene file = open(b);
        const Scene before = file.at(0, kFirst), after = file.at(1, kFirst);
        ASSERT_EQ(before.instances.size(), b.json["nodes"].size());
        ASSERT_EQ(after.instances.size(), before.instances.size());
        const auto mesh = [](const Scene& scene, std::size_t i) { return scene.meshes.at(scene.instances[i].mesh); };
        EXPECT_EQ(before.instances[0].name, "hidden");
        EXPECT_EQ(before.meshes[0].name, "leaf");
        EXPECT_FALSE(has_surface(before, before.instances[0]));
        EXPECT_EQ(mesh(before, 0).positions.empty(), before.instances.size() == 1) << "no instance shows it";
        EXPECT_EQ(mesh(after, 0).triangles.size(), 1u);
        for (std::size_t i = 1; i < before.instances.size(); ++i) EXPECT_EQ(mesh(before, i).triangles.size(), 1u);
        EXPECT_TRUE(before.report.warnings.empty());
    }
    GltfBuilder skin = skinned_by_two_sets();
    for (const int joint : {1, 2})
        animate(skin, joint, "scale", "STEP", skin.floats("SCALAR", {0, 1}), skin.floats("VEC3", {1, 1, 1, 0, 0, 0}));
    const std::size_t both[] = {1, 2};
    GltfScene file = open(skin);
    EXPECT_EQ(file.at(0, both).meshes.at(0).triangles.size(), 1u);
    const Scene collapsed = file.at(1, both);
    ASSERT_EQ(collapsed.instances.size(), 1u);
    EXPECT_TRUE(collapsed.meshes.at(0).triangles.empty());
}

TEST_F(GltfAnimation, ImagesAreReadOnceForAllPoses) {
    GltfBuilder b = moving();
    b.json["images"] = {{{"uri", "texture.png"}}};
    b.json["textures"] = {{{"source", 0}}};
    b.json["materials"] = {{{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}}};
    b.json["meshes"][0]["primitives"][0]["material"] = 0;
    write_png(folder_ / "texture.png", 2, 1, 4, std::vector<std::uint8_t>{1, 2, 3, 255, 4, 5, 6, 255});
    GltfScene file = open(b);
    Scene scene = file.at_rest();
    ASSERT_EQ(scene.images.size(), 1u);
    std::filesystem::remove(folder_ / "texture.png");
    file.pose(scene, 1, kFirst);
    EXPECT_EQ(scene.images.size(), 1u);
}

TEST_F(GltfAnimation, WarningsAreOfOnePose) {
    GltfBuilder b = moving();
    b.push("nodes", {{"mesh", 0}, {"scale", {0, 0, 0}}});
    Json& channels = b.json["animations"][0]["channels"];
    channels.push_back({{"sampler", 0}, {"target", {{"node", 0}, {"path", "visibility"}}}});
    channels.push_back({{"sampler", 0}, {"target", {{"path", "translation"}}}});
    GltfScene scene = open(b);
    const std::vector<std::string> expected = {"nodes[1]: its transform leaves no area, it is left out"};
    EXPECT_EQ(scene.at(0, kFirst).report.warnings, expected);
    EXPECT_EQ(scene.at(1, kFirst).report.warnings, expected);
    EXPECT_EQ(scene.animations()[0].channels.size(), 1u);
    EXPECT_EQ(scene.animation_warnings(),
              (std::vector<std::string>{
                  "animations[0].channels[1]: drives 'visibility', which is not supported; it is left out",
                  "animations[0].channels[2]: drives no node, it is left out"}));
}

TEST_F(GltfAnimation, DamagedAnimationsAreRefusedWhenPlayed) {
    const auto refused = [&](const std::function<void(GltfBuilder&)>& damage, const std::string& message) {
        GltfBuilder b = moving();
        damage(b);
        EXPECT_EQ(refusal_in_motion(b), message);
        EXPECT_NO_THROW(load(b)) << "at rest: " << message;
    };
    const auto sampler = [](const char* key, const Json& value) {
        return [=](GltfBuilder& b) { b.json["animations"][0]["samplers"][0][key] = value; };
    };
    const auto input = [](const std::vector<float>& times) {
        return [=](GltfBuilder& b) { b.json["animations"][0]["samplers"][0]["input"] = b.floats("SCALAR", times); };
    };
    const auto target = [](const char* key, const Json& value) {
        return [=](GltfBuilder& b) { b.json["animations"][0]["channels"][0]["target"][key] = value; };
    };
    const std::string first = "animations[0].samplers[0]";
    refused([](GltfBuilder& b) { b.json["animations"] = 1; }, "animations: is not an array");
    refused([](GltfBuilder& b) { b.json["animations"][0].erase("samplers"); }, "animations[0]: has no 'samplers'");
    refused(sampler("input", 99), first + ".input: 99 is not an index into accessors, which has 3");
    refused(sampler("interpolation", "BOUNCE"), first + ": interpolation 'BOUNCE' is unknown");
    refused(sampler("interpolation", "CUBICSPLINE"), first + ": its output has 2 elements for 2 keys, 6 expected");
    refused(sampler("input", 2), "accessors[2]: has 3 components, " + first + ".input needs 1");
    refused(input({0, -1}), first + ": key 1 at -1 s comes after one at 0 s");
    refused(input({0, std::nanf("")}), first + ": the time of key 1 is not finite");
    refused(input({0, 1, 2}), first + ": its output has 2 elements for 3 keys, 3 expected");
    refused(target("node", 3), "animations[0].channels[0].target.node: 3 is not an index into nodes, which has 1");
    refused(target("path", "weights"),
            "animations[0].channels[0]: drives weights of nodes[0], which has no morph targets");
    refused(target("path", "rotation"), "accessors[2]: has 3 components, " + first + ".output needs 4");
    refused([](GltfBuilder& b) { b.json["animations"][0]["channels"][0]["sampler"] = 4; },
            "animations[0].channels[0]: sampler 4 is not an index into its samplers, which has 1");
    refused(
        [](GltfBuilder& b) {
            b.json["nodes"][0]["matrix"] = std::vector<int>{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
        },
        "animations[0].channels[0]: nodes[0] has a matrix, which cannot be driven");
    refused(
        [](GltfBuilder& b) {
            b.json["animations"][0]["samplers"][0]["output"] = b.floats("VEC3", {0, 0, 0, INFINITY, 0, 0});
        },
        first + ": key 1 is not finite");
}

TEST_F(GltfAnimation, ADamagedAnimationLeavesTheOthersUsable) {
    GltfBuilder b = moving();
    const Json good = b.json["animations"][0];
    Json damaged = good;
    damaged["name"] = "broken";
    damaged["samplers"][0]["input"] = 99;
    b.json["animations"] = {damaged, good, 7};
    GltfScene scene = open(b);
    ASSERT_EQ(scene.animations().size(), 3u);
    EXPECT_EQ(scene.animations()[0].name, "broken");
    ASSERT_TRUE(scene.animations()[0].damage);
    EXPECT_TRUE(scene.animations()[0].channels.empty());
    EXPECT_FALSE(scene.animations()[1].damage);
    ASSERT_TRUE(scene.animations()[2].damage);
    EXPECT_EQ(without_name(scene.animations()[2].damage->what()), "animations[2]: is not an object");
    const std::size_t second[] = {1}, all[] = {0, 1};
    EXPECT_EQ(scene.at(0.5, second).instances.at(0).object_to_world[3], dvec4(1, 0, 0, 1));
    const std::string why = "animations[0].samplers[0].input: 99 is not an index into accessors, which has 3";
    EXPECT_EQ(without_name(error_message([&] { scene.at(0.5, all); })), why);
    EXPECT_EQ(without_name(error_message([&] { scene.at(0.5, kFirst); })), why);
    EXPECT_EQ(scene.at(0.5, second).instances.at(0).object_to_world[3], dvec4(1, 0, 0, 1)) << "after the failures";
}

/// The specification forbids these, but the animation plays as it was meant.
TEST_F(GltfAnimation, HarmlessViolationsGiveWarnings) {
    const auto warned = [&](const std::function<void(GltfBuilder&)>& change, const std::string& warning) {
        GltfBuilder b = moving();
        EXPECT_TRUE(open(b).animation_warnings().empty());
        change(b);
        GltfScene scene = open(b);
        EXPECT_EQ(scene.animation_warnings(), std::vector<std::string>{warning});
        if (!scene.animations().empty()) {
            EXPECT_NO_THROW(scene.at(0.5, kFirst));
        }
    };
    const std::string first = "animations[0]", sampler = first + ".samplers[0]: ";
    warned([](GltfBuilder& b) { b.json["animations"] = Json::array(); }, "animations: is an empty list");
    warned([](GltfBuilder& b) { b.json["animations"][0]["channels"] = Json::array(); }, first + ": has no channels");
    warned([](GltfBuilder& b) { b.json["accessors"][1].erase("max"); }, sampler + "its times have no min and max");
    warned([](GltfBuilder& b) { b.json["bufferViews"][2]["byteStride"] = 12; },
           sampler + "has a byteStride in bufferViews[2], as only vertices may");
    warned(
        [](GltfBuilder& b) {
            b.json["animations"][0]["samplers"][0]["input"] = b.floats("SCALAR", {-1, 1});
        },
        sampler + "its first key is at -1 s, before 0");
    warned(
        [](GltfBuilder& b) {
            Json& channels = b.json["animations"][0]["channels"];
            channels.push_back(Json(channels[0]));
        },
        first + ": several channels drive the same property, and only the last one counts");
    warned(
        [](GltfBuilder& b) {
            Json& from = b.json["animations"][0]["samplers"][0];
            from = {{"input", b.floats("SCALAR", {0})},
                    {"output", b.floats("VEC3", std::vector<float>(9, 1))},
                    {"interpolation", "CUBICSPLINE"}};
        },
        sampler + "is a cubic spline of fewer than two keys");
}

TEST_F(GltfAnimation, SamplersAreCheckedWithoutANode) {
    GltfBuilder b = moving();
    b.json["animations"][0]["channels"][0]["target"].erase("node");
    EXPECT_FALSE(open(b).animations()[0].damage);
    const auto damage = [&](const char* key, int accessor) {
        GltfBuilder bad = b;
        bad.json["animations"][0]["samplers"][0][key] = accessor;
        const auto found = open(bad).animations()[0].damage;
        return found ? without_name(found->what()) : "none";
    };
    EXPECT_EQ(damage("input", b.accessor("SCALAR", kU32, std::vector<std::uint32_t>{0, 1})),
              "animations[0].samplers[0]: its times in accessors[3] are not floating-point numbers");
    EXPECT_EQ(damage("output", b.floats("VEC4", std::vector<float>(8, 1))),
              "accessors[4]: has 4 components, animations[0].samplers[0].output needs 3");
    EXPECT_EQ(damage("output", b.floats("VEC3", std::vector<float>(9, 1))),
              "animations[0].samplers[0]: its output has 3 elements for 2 keys, 2 expected");
}

TEST_F(GltfAnimation, MovingInstancesAreMarkedInEveryPose) {
    const auto flags = [](const Scene& scene) {
        std::vector<std::pair<bool, bool>> all;  // whether each animation moves, and deforms
        for (const Instance& i : scene.instances)
            all.emplace_back(i.moves, scene.meshes[static_cast<std::size_t>(i.mesh)].deforms);
        return all;
    };
    using Flags = std::vector<std::pair<bool, bool>>;
    GltfBuilder b = moving();
    b.push("nodes", {{"mesh", 0}});
    b.push("nodes", {{"mesh", 0}});
    b.json["nodes"][0]["children"] = {2};
    for (const double seconds : {0.0, 0.5, 3.0}) {
        EXPECT_EQ(flags(open(b).at(seconds, kFirst)), (Flags{{true, false}, {true, false}, {false, false}}))
            << "a node, the one below it, and one apart";
        EXPECT_EQ(flags(open(skinned_by_two_sets()).at(seconds, kFirst)), (Flags{{false, true}}));
        EXPECT_EQ(flags(open(morphed()).at(seconds, kFirst)), (Flags{{false, true}}));
    }
    EXPECT_EQ(flags(open(b).at(0, {})), (Flags(3, {false, false}))) << "nothing plays";
    EXPECT_EQ(flags(load(morphed())), (Flags{{false, false}}));
}

TEST_F(GltfAnimation, PosingASceneEqualsPosingTheFile) {
    for (GltfBuilder b : {moving(), skinned_by_two_sets(), morphed()}) {
        // A second mesh stays still and needs a repair.
        const int node = b.push("nodes", Json::object());
        b.add_triangle();
        b.json["nodes"][static_cast<std::size_t>(node)] = {{"mesh", 1}};
        b.json["meshes"][1]["primitives"].push_back(b.json["meshes"][1]["primitives"][0]);
        b.json["meshes"][1]["primitives"][1].erase("attributes");
        b.json["meshes"][1]["primitives"][1]["attributes"] = Json::object();
        GltfScene file = open(b), other = open(b);
        Scene scene = file.at(0, kFirst);
        for (const double seconds : {0.5, 1.0, 0.25}) {
            file.pose(scene, seconds, kFirst);
            const Scene expected = open(b).at(seconds, kFirst), again = other.at(seconds, kFirst);
            for (const Scene* found : {&std::as_const(scene), &again}) {
                ASSERT_EQ(found->meshes.size(), expected.meshes.size());
                for (std::size_t i = 0; i < expected.meshes.size(); ++i) {
                    EXPECT_EQ(found->meshes[i].positions, expected.meshes[i].positions);
                    EXPECT_EQ(found->meshes[i].normals, expected.meshes[i].normals);
                    EXPECT_EQ(found->meshes[i].triangles, expected.meshes[i].triangles);
                    EXPECT_EQ(found->meshes[i].deforms, expected.meshes[i].deforms);
                }
                ASSERT_EQ(found->instances.size(), expected.instances.size());
                for (std::size_t i = 0; i < expected.instances.size(); ++i)
                    EXPECT_EQ(found->instances[i].object_to_world, expected.instances[i].object_to_world);
                EXPECT_EQ(found->materials.size(), expected.materials.size());
                EXPECT_EQ(found->report.warnings, expected.report.warnings);
                EXPECT_EQ(found->report.normals_generated, expected.report.normals_generated);
            }
            EXPECT_GT(expected.report.normals_generated, 0u);
            EXPECT_FALSE(expected.report.warnings.empty());
        }
    }
}

TEST_F(GltfAnimation, AFailedPoseLeavesTheSceneUnchanged) {
    GltfBuilder b = moving();
    const float huge = std::numeric_limits<float>::max();
    b.push("nodes", {{"children", {0}}, {"scale", {10, 10, 10}}});
    b.json["animations"][0]["samplers"][0]["output"] = b.floats("VEC3", {0, 0, 0, huge, 0, 0});
    GltfScene file = open(b);
    Scene scene = file.at(0, kFirst);
    scene.images.push_back({"mine", 1, 1, {1, 2, 3, 4}});
    EXPECT_THROW(file.pose(scene, 1, kFirst), Error);
    EXPECT_EQ(scene.instances.size(), 1u);
    file.pose(scene, 0, kFirst);
    ASSERT_EQ(scene.images.size(), 1u) << "images stay where they are";
    EXPECT_EQ(scene.images[0].name, "mine");
}

TEST_F(GltfAnimation, APoseThatOverflowsIsNamed) {
    GltfBuilder b = moving();
    const float huge = std::numeric_limits<float>::max();
    b.push("nodes", {{"children", {0}}, {"scale", {10, 10, 10}}});
    b.json["animations"][0]["samplers"][0]["output"] = b.floats("VEC3", {0, 0, 0, huge, 0, 0});
    GltfScene scene = open(b);
    EXPECT_NO_THROW(scene.at(0, kFirst));
    EXPECT_EQ(without_name(error_message([&] { scene.at(1, kFirst); })), "nodes[0]: its transform overflows");
    EXPECT_NO_THROW(scene.at(0, kFirst)) << "and others go on";
}

TEST_F(GltfAnimation, FilesThatWereReadAreListed) {
    GltfBuilder b = moving();
    b.add_buffer();
    b.json["buffers"][0]["uri"] = "scene.bin";
    write("scene.bin", b.bytes());
    GltfScene scene(write("scene.gltf", b.json.dump()));
    std::vector<std::filesystem::path> paths;
    for (const VersionedFile& file : scene.files()) {
        paths.push_back(file.path);
        EXPECT_EQ(file.version, versioned(file.path).version);
    }
    EXPECT_EQ(paths, (std::vector<std::filesystem::path>{folder_ / "scene.gltf", folder_ / "scene.bin"}));
    write_file(folder_ / "scene.bin", b.bytes());
    EXPECT_NE(scene.files()[1].version, versioned(folder_ / "scene.bin").version);
}

TEST_F(GltfAnimation, FrameRatesAreFoundInExtras) {
    const auto found = [&](const Json& of_asset, const Json& of_scene) {
        GltfBuilder b;
        b.add_triangle();
        b.json["scenes"] = {{{"nodes", Json::array()}, {"extras", {{"fps", 12}}}},
                            {{"nodes", {0}}, {"extras", of_scene}}};
        b.json["scene"] = 1;
        b.json["asset"]["extras"] = of_asset;
        GltfScene scene(write("scene.glb", b.glb()));
        return std::pair(scene.frame_rate(), scene.at_rest().report.warnings);
    };
    using Warnings = std::vector<std::string>;
    const auto is = [&](const Json& of_asset, const Json& of_scene, const FrameRate& rate) {
        EXPECT_EQ(found(of_asset, of_scene), std::pair(std::optional(rate), Warnings()))
            << of_asset.dump() << of_scene.dump();
    };
    is({}, {{"fps", 30}}, {30, 1});
    is({}, {{"frame_rate", 12.5}}, {25, 2});
    is({{"fps", 50}}, {{"mood", "grey"}}, {50, 1});
    is({{"fps", 50}}, {{"frame_rate", 30}}, {30, 1});
    for (const double film : {23.976, 24000.0 / 1001, double(23.976f)}) is({{"fps", film}}, {}, {24000, 1001});
    is({}, {{"fps", double(29.97f)}}, {30000, 1001});
    EXPECT_EQ(found({}, {}), std::pair(std::optional<FrameRate>(), Warnings()));
    EXPECT_EQ(found(Json::array({1}), "fps"), std::pair(std::optional<FrameRate>(), Warnings())) << "no objects";
    const std::string ignored = " is no number of frames per second from 0.001 to 1000000; it is ignored";
    for (const Json& bad :
         {Json("24"), Json(0), Json(-24), Json(1e300), Json(1e-9), Json(true), Json(), Json::object()})
        EXPECT_EQ(found({{"frame_rate", 25}}, {{"fps", bad}}),
                  std::pair(std::optional(FrameRate{25, 1}), Warnings{"scenes[1].extras: fps" + ignored}))
            << bad.dump();
}

}  // namespace
}  // namespace halflight
