// Tests animations of glTF files and the poses that they produce.
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <limits>
#include <optional>
#include <tuple>

#include "engine/io/files.h"
#include "engine/scene/geometry.h"
#include "tests/unit/io/gltf_builder.h"

namespace halflight {
namespace {

using GltfAnimation = GltfTest;

/// Returns a triangle that moves from x = 0 to x = 2 in one second.
GltfBuilder moving() {
    GltfBuilder b;
    b.add_triangle();
    const int times = b.floats("SCALAR", {0, 1});
    b.animate(0, "translation", times, b.floats("VEC3", {0, 0, 0, 2, 0, 0}))["name"] = "slide";
    return b;
}

TEST_F(GltfAnimation, MovesTurnsAndScalesNodes) {
    GltfBuilder b = moving();
    b.json["nodes"][0]["translation"] = {9, 9, 9};
    GltfScene scene = open(b);
    const auto place = [](const Scene& posed) { return dvec3(posed.instances.at(0).object_to_world[3]); };
    EXPECT_EQ(place(scene.at(0.25, {})), dvec3(9)) << "at rest";
    EXPECT_EQ(place(scene.at(0.25, kFirst)), dvec3(0.5, 0, 0));
    EXPECT_EQ(place(scene.at(7, kFirst)), dvec3(2, 0, 0));
    EXPECT_EQ(place(scene.at(-7, kFirst)), dvec3(0));
    EXPECT_EQ(place(scene.at(0, {})), dvec3(9)) << "and at rest again";
    scene.at(1, kFirst);
    EXPECT_EQ(place(scene.at_rest()), dvec3(9)) << "and so";

    // The last channel of a property counts.
    b.animate(0, "translation", b.floats("SCALAR", {0}), b.floats("VEC3", {0, 5, 0}), "STEP");
    const std::size_t both[] = {0, 1}, reversed[] = {1, 0};
    EXPECT_EQ(place(open(b).at(1, both)), dvec3(0, 5, 0));
    EXPECT_EQ(place(open(b).at(1, reversed)), dvec3(2, 0, 0));

    // The keys are a rotation by 90 degrees as normalized shorts, and a scale of two.
    const int times = b.floats("SCALAR", {0, 1});
    const std::vector<std::int16_t> quarter = {0, 0, 0, 32767, 0, 0, 23170, 23170};
    b.animate(0, "rotation", times, b.accessor("VEC4", kI16, quarter, true));
    b.animate(0, "scale", times, b.floats("VEC3", {1, 1, 1, 2, 2, 2}), "STEP");
    const std::size_t all[] = {0, 2, 3};
    const dmat4 found = open(b).at(1, all).instances.at(0).object_to_world;
    const dmat4 expected =
        glm::scale(glm::rotate(glm::translate(dmat4(1), dvec3(2, 0, 0)), kPi / 2, dvec3(0, 0, 1)), dvec3(2));
    for (int column = 0; column < 4; ++column)
        EXPECT_LT(glm::distance(found[column], expected[column]), 1e-6) << column;
}

TEST_F(GltfAnimation, CubicSplineFollowsTheSpecification) {
    GltfBuilder b;
    b.add_triangle();
    // Each row holds in-tangent, value and out-tangent: y = t^2 (3 - t) / 4 from 0 to 2 s.
    const int output = b.floats("VEC3", {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0});
    b.animate(0, "translation", b.floats("SCALAR", {0, 2}), output, "CUBICSPLINE");
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
    b.animate(2, "translation", b.floats("SCALAR", {0, 1}), b.floats("VEC3", {0, 0, 0, 0, 8, 0}));
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
    b.make_sparse(sparse, {2}, {0, 0, 6});
    const int up = b.floats("VEC3", {0, 2, 0, 0, 2, 0, 0, 2, 0});
    primitive["targets"] = {{{"POSITION", up}}, {{"POSITION", sparse}}};
    b.json["meshes"][0]["weights"] = {0.25, 0};
    const int weights = b.accessor("SCALAR", kU8, std::vector<std::uint8_t>{0, 0, 255, 51}, true);
    b.animate(0, "weights", b.floats("SCALAR", {0, 1}), weights);
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
    b.json["nodes"][0]["camera"] = 0;
    b.add_perspective_camera();
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

/// A scale of 0 hides surfaces for a while (glTF 2.0, section 3.5.2). The objects stay, so that edits find them.
TEST_F(GltfAnimation, HiddenSurfacesKeepTheirInstances) {
    for (const bool alone : {false, true}) {
        GltfBuilder b;
        b.add_triangle();
        b.json["meshes"][0]["name"] = "leaf";
        b.json["nodes"][0]["name"] = "hidden";
        if (!alone) b.push("nodes", {{"mesh", 0}, {"name", "shown"}});
        b.animate(0, "scale", b.floats("SCALAR", {0, 1}), b.floats("VEC3", {0, 0, 0, 2, 2, 2}), "STEP");
        GltfScene file = open(b);
        const Scene before = file.at(0, kFirst), after = file.at(1, kFirst);
        ASSERT_EQ(before.instances.size(), b.json["nodes"].size());
        ASSERT_EQ(after.instances.size(), before.instances.size());
        const auto mesh = [](const Scene& scene, std::size_t i) { return scene.meshes.at(scene.instances[i].mesh); };
        EXPECT_EQ(before.instances[0].name, "hidden");
        EXPECT_EQ(before.meshes[0].name, "leaf");
        EXPECT_FALSE(has_surface(before, before.instances[0]));
        EXPECT_EQ(mesh(before, 0).positions.empty(), alone) << "no instance shows it";
        EXPECT_EQ(mesh(after, 0).triangles.size(), 1u);
        for (std::size_t i = 1; i < before.instances.size(); ++i) EXPECT_EQ(mesh(before, i).triangles.size(), 1u);
        EXPECT_TRUE(before.report.warnings.empty());
    }
    GltfBuilder skin = skinned_by_two_sets();
    for (const int joint : {1, 2})
        skin.animate(joint, "scale", skin.floats("SCALAR", {0, 1}), skin.floats("VEC3", {1, 1, 1, 0, 0, 0}), "STEP");
    const std::size_t both[] = {1, 2};
    GltfScene file = open(skin);
    EXPECT_EQ(file.at(0, both).meshes.at(0).triangles.size(), 1u);
    const Scene collapsed = file.at(1, both);
    ASSERT_EQ(collapsed.instances.size(), 1u);
    EXPECT_TRUE(collapsed.meshes.at(0).triangles.empty());
}

TEST_F(GltfAnimation, WarningsAreOfOnePose) {
    GltfBuilder b = moving();
    b.push("nodes", {{"mesh", 0}, {"scale", {0, 0, 0}}});
    Json& channels = b.json["animations"][0]["channels"];
    channels.push_back({{"sampler", 0}, {"target", {{"node", 0}, {"path", "visibility"}}}});
    channels.push_back({{"sampler", 0}, {"target", {{"path", "translation"}}}});
    GltfScene scene = open(b);
    for (const double seconds : {0, 1}) expect_warnings(scene.at(seconds, kFirst).report.warnings, {"nodes[1]: "});
    EXPECT_EQ(scene.animations()[0].channels.size(), 1u);
    expect_warnings(scene.animation_warnings(),
                    {"animations[0].channels[1]: drives 'visibility'", "animations[0].channels[2]: drives no node"});
}

TEST_F(GltfAnimation, DamagedAnimationsAreRefusedWhenPlayed) {
    GltfBuilder whole = moving();
    const int still = whole.floats("SCALAR", {0, -1}), never = whole.floats("SCALAR", {0, std::nanf("")});
    const int three = whole.floats("SCALAR", {0, 1, 2}), infinite = whole.floats("VEC3", {0, 0, 0, INFINITY, 0, 0});
    const std::string first = "animations[0].samplers[0]", sampler = "/animations/0/samplers/0";
    const std::string channel = "animations[0].channels[0]", target = "/animations/0/channels/0/target";
    const Refusal cases[] = {
        {"/animations", 1, "animations: "},
        {"/animations/0/samplers", kRemoved, "animations[0]: has no 'samplers'"},
        {sampler + "/input", 99, first + ".input: "},
        {sampler + "/interpolation", "BOUNCE", first + ": interpolation 'BOUNCE'"},
        {sampler + "/interpolation", "CUBICSPLINE", first + ": its output has 2 elements for 2 keys, 6 expected"},
        {sampler + "/input", 2, "accessors[2]: "},
        {sampler + "/input", still, first + ": key 1 at -1 s"},
        {sampler + "/input", never, first + ": the time of key 1"},
        {sampler + "/input", three, first + ": its output has 2 elements for 3 keys"},
        {sampler + "/output", infinite, first + ": key 1"},
        {target + "/node", 3, channel + ".target.node: "},
        {target + "/path", "weights", channel + ": drives weights of nodes[0]"},
        {target + "/path", "rotation", "accessors[2]: "},
        {"/animations/0/channels/0/sampler", 4, channel + ": sampler 4"},
        {"/nodes/0/matrix", {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}, channel + ": nodes[0] has a matrix"},
    };
    for (const auto& [pointer, value, message] : cases) {
        GltfBuilder b = whole;
        b.put(pointer, value);
        EXPECT_TRUE(refusal_in_motion(b).starts_with(message)) << pointer << ": " << refusal_in_motion(b);
        EXPECT_NO_THROW(load(b)) << "at rest: " << message;
    }
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
    EXPECT_EQ(scene.animations()[0].end, 0);
    EXPECT_FALSE(scene.animations()[1].damage);
    EXPECT_EQ(scene.animations()[1].name, "slide");
    EXPECT_EQ(scene.animations()[1].channels.size(), 1u);
    EXPECT_EQ(scene.animations()[1].end, 1);
    ASSERT_TRUE(scene.animations()[2].damage);
    EXPECT_TRUE(without_name(scene.animations()[2].damage->what()).starts_with("animations[2]: "));
    const std::size_t second[] = {1}, all[] = {0, 1};
    EXPECT_EQ(scene.at(0.5, second).instances.at(0).object_to_world[3], dvec4(1, 0, 0, 1));
    for (const GltfScene::Playing playing : {GltfScene::Playing(all), GltfScene::Playing(kFirst)})
        EXPECT_TRUE(without_name(error_message([&] { scene.at(0.5, playing); })).starts_with("animations[0].samplers"));
    EXPECT_EQ(scene.at(0.5, second).instances.at(0).object_to_world[3], dvec4(1, 0, 0, 1)) << "after the failures";
}

/// The specification forbids these, but the animation plays as it was meant.
TEST_F(GltfAnimation, HarmlessViolationsGiveWarnings) {
    GltfBuilder whole = moving();
    const int early = whole.floats("SCALAR", {-1, 1});
    const Json spline = {{"input", whole.floats("SCALAR", {0})},
                         {"output", whole.floats("VEC3", std::vector<float>(9, 1))},
                         {"interpolation", "CUBICSPLINE"}};
    const Json channel = whole.json["animations"][0]["channels"][0];
    EXPECT_TRUE(open(whole).animation_warnings().empty());
    const std::string first = "animations[0]", sampler = first + ".samplers[0]: ";
    const Refusal cases[] = {
        {"/animations", Json::array(), "animations: is an empty list"},
        {"/animations/0/channels", Json::array(), first + ": has no channels"},
        {"/animations/0/channels", Json::array({channel, channel}), first + ": several channels"},
        {"/accessors/1/max", kRemoved, sampler + "its times have no min and max"},
        {"/bufferViews/2/byteStride", 12, sampler + "has a byteStride in bufferViews[2]"},
        {"/animations/0/samplers/0/input", early, sampler + "its first key"},
        {"/animations/0/samplers/0", spline, sampler + "is a cubic spline"},
    };
    for (const auto& [pointer, value, warning] : cases) {
        GltfBuilder b = whole;
        b.put(pointer, value);
        GltfScene scene = open(b);
        expect_warnings(scene.animation_warnings(), {warning});
        if (scene.animations().empty()) continue;
        EXPECT_NO_THROW(scene.at(0.5, kFirst));
    }
}

TEST_F(GltfAnimation, SamplersAreCheckedWithoutANode) {
    GltfBuilder b = moving();
    const int integers = b.accessor("SCALAR", kU32, std::vector<std::uint32_t>{0, 1});
    const int vec4s = b.floats("VEC4", std::vector<float>(8, 1)), three = b.floats("VEC3", std::vector<float>(9, 1));
    b.put("/animations/0/channels/0/target/node", kRemoved);
    EXPECT_FALSE(open(b).animations()[0].damage);
    const Refusal cases[] = {{"input", integers, "animations[0].samplers[0]: "},
                             {"output", vec4s, "accessors[4]: "},
                             {"output", three, "animations[0].samplers[0]: "}};
    for (const auto& [key, accessor, message] : cases) {
        GltfBuilder bad = b;
        bad.put("/animations/0/samplers/0/" + key, accessor);
        const auto damage = open(bad).animations()[0].damage;
        EXPECT_TRUE(damage && without_name(damage->what()).starts_with(message)) << key << " " << accessor;
    }
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
    const auto content = [](const Scene& scene) {
        std::vector<std::tuple<std::vector<vec3>, std::vector<vec3>, std::vector<uvec3>, bool>> meshes;
        for (const Mesh& m : scene.meshes) meshes.emplace_back(m.positions, m.normals, m.triangles, m.deforms);
        std::vector<std::pair<int, dmat4>> instances;
        for (const Instance& i : scene.instances) instances.emplace_back(i.mesh, i.object_to_world);
        return std::tuple(meshes, instances, scene.materials.size(), scene.report.warnings,
                          scene.report.normals_generated);
    };
    for (GltfBuilder b : {moving(), skinned_by_two_sets(), morphed()}) {
        // A second mesh stays still and needs a repair.
        b.add_triangle();
        b.json["meshes"][1]["primitives"].push_back({{"attributes", Json::object()}});
        GltfScene file = open(b), other = open(b);
        Scene scene = file.at(0, kFirst);
        for (const double seconds : {0.5, 1.0, 0.25}) {
            file.pose(scene, seconds, kFirst);
            const Scene expected = open(b).at(seconds, kFirst);
            EXPECT_TRUE(content(scene) == content(expected)) << seconds;
            EXPECT_TRUE(content(other.at(seconds, kFirst)) == content(expected)) << seconds;
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
    EXPECT_TRUE(without_name(error_message([&] { file.pose(scene, 1, kFirst); })).starts_with("nodes[0]: "));
    EXPECT_EQ(scene.instances.size(), 1u);
    file.pose(scene, 0, kFirst);
    ASSERT_EQ(scene.images.size(), 1u) << "images stay where they are";
    EXPECT_EQ(scene.images[0].name, "mine");
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
    const auto expect_rate = [&](const Json& of_asset, const Json& of_scene, const std::optional<FrameRate>& rate,
                                 const std::vector<std::string>& warnings = {}) {
        SCOPED_TRACE(of_asset.dump() + of_scene.dump());
        GltfBuilder b;
        b.add_triangle();
        b.json["scenes"] = {{{"nodes", Json::array()}, {"extras", {{"fps", 12}}}},
                            {{"nodes", {0}}, {"extras", of_scene}}};
        b.json["scene"] = 1;
        b.json["asset"]["extras"] = of_asset;
        GltfScene scene = open(b);
        EXPECT_EQ(scene.frame_rate(), rate);
        expect_warnings(scene.at_rest().report.warnings, warnings);
    };
    expect_rate({}, {{"fps", 30}}, FrameRate{30, 1});
    expect_rate({}, {{"frame_rate", 12.5}}, FrameRate{25, 2});
    expect_rate({{"fps", 50}}, {{"mood", "grey"}}, FrameRate{50, 1});
    expect_rate({{"fps", 50}}, {{"frame_rate", 30}}, FrameRate{30, 1});
    for (const double film : {23.976, 24000.0 / 1001, double(23.976f)})
        expect_rate({{"fps", film}}, {}, FrameRate{24000, 1001});
    expect_rate({}, {{"fps", double(29.97f)}}, FrameRate{30000, 1001});
    expect_rate({}, {}, {});
    expect_rate(Json::array({1}), "fps", {});
    for (const Json& bad : {Json("24"), Json(0), Json(-24), Json(1e300), Json(1e-9), Json(true), Json()})
        expect_rate({{"frame_rate", 25}}, {{"fps", bad}}, FrameRate{25, 1}, {"scenes[1].extras: fps"});
}

}  // namespace
}  // namespace halflight
