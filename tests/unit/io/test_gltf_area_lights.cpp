// Tests EXT_lights_area: size, orientation and emission of rectangles and discs, scaled nodes, and damaged values.
#include <algorithm>
#include <array>

#include "tests/unit/io/gltf_builder.h"

namespace halflight {
namespace {

using GltfAreaLight = GltfTest;

GltfBuilder with_lights(const Json& list) {
    GltfBuilder b;
    b.add_triangle();
    b.json["extensions"]["EXT_lights_area"]["lights"] = list;
    for (std::size_t i = 0; i < list.size(); ++i)
        b.push("nodes", {{"name", "lamp"}, {"extensions", {{"EXT_lights_area", {{"light", i}}}}}});
    b.require({"EXT_lights_area"});
    return b;
}

/// Bounds and areas of a light in the world.
struct Shape {
    dvec3 least{1e9}, most{-1e9};  // bounds of emissive triangles
    dvec3 front{0}, all{0};        // sums of the area vectors of emissive triangles, and of all
};

Shape shape_of(const Scene& scene, const Instance& instance) {
    const Mesh& mesh = scene.meshes[static_cast<std::size_t>(instance.mesh)];
    Shape shape;
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        std::array<dvec3, 3> corners;
        for (int k = 0; k < 3; ++k)
            corners[std::size_t(k)] = instance.object_to_world * dvec4(mesh.positions[mesh.triangles[i][k]], 1);
        const double side = glm::determinant(dmat3(instance.object_to_world)) < 0 ? -0.5 : 0.5;  // a mirror swaps faces
        const dvec3 area = side * glm::cross(corners[1] - corners[0], corners[2] - corners[0]);
        shape.all += area;
        if (scene.materials[mesh.triangle_material[i]].emission == vec3(0)) continue;
        shape.front += area;
        for (const dvec3& corner : corners)
            shape.least = glm::min(shape.least, corner), shape.most = glm::max(shape.most, corner);
    }
    return shape;
}

TEST_F(GltfAreaLight, EmitsFromItsFrontAlone) {
    GltfBuilder b = with_lights({{{"type", "rect"}, {"size", 2}, {"rect", {{"aspect", 3}}}, {"name", "panel"}},
                                 {{"type", "disk"}, {"size", 4}, {"intensity", 50}, {"color", {1, 0.5, 0.25}}}});
    b.json["nodes"][1].update({{"translation", {0, 5, 0}}, {"rotation", {-std::sqrt(0.5), 0, 0, std::sqrt(0.5)}}});
    const Scene scene = load(b);
    EXPECT_TRUE(scene.report.warnings.empty()) << scene.report.warnings[0];
    EXPECT_TRUE(scene.lights.empty());
    ASSERT_EQ(scene.instances.size(), 3u);
    const Shape panel = shape_of(scene, scene.instances[1]), disc = shape_of(scene, scene.instances[2]);
    EXPECT_LT(glm::distance(panel.front, dvec3(0, -12, 0)), 1e-5) << "-Z of the node is down";
    EXPECT_LT(glm::distance(panel.most, dvec3(3, 5, 1)), 1e-5);
    EXPECT_LT(glm::distance(disc.front, dvec3(0, 0, -kPi * 4)), 1e-5);
    EXPECT_NEAR(disc.most.x, 2, 0.002);
    for (const std::size_t i : {1, 2}) {
        const std::vector<vec3>& all = scene.meshes[static_cast<std::size_t>(scene.instances[i].mesh)].positions;
        const auto right = std::ranges::max(all, {}, [](const vec3& p) { return p.x; });
        EXPECT_GT(right.x, 0.5008f) << "a rim keeps rays from behind off the edge of the front";
    }
    for (const Shape& shape : {panel, disc}) EXPECT_LT(glm::length(shape.all), 1e-5) << "the body is closed";
    ASSERT_EQ(scene.materials.size(), 4u);
    EXPECT_EQ(scene.materials[0].emission, vec3(0)) << "of the bodies";
    EXPECT_EQ(scene.materials[1].name, "panel");
    EXPECT_EQ(scene.materials[1].emission, vec3(1000));
    EXPECT_EQ(scene.materials[2].emission, 50.0f * vec3(1, 0.5, 0.25));
    for (const std::size_t i : {0, 1, 2}) {
        EXPECT_EQ(scene.materials[i].base_color, vec4(0, 0, 0, 1));
        EXPECT_EQ(scene.materials[i].specular, 0);
    }
}

TEST_F(GltfAreaLight, ScalesByTheLargestComponentOfItsNode) {
    GltfBuilder b = with_lights({{{"type", "rect"}}, {{"type", "rect"}}});
    b.json["nodes"][1]["scale"] = {3, 0.5, 1};
    b.json["nodes"][2]["scale"] = {1, -2, 1};
    const Scene scene = load(b);
    EXPECT_LT(glm::distance(shape_of(scene, scene.instances[1]).front, dvec3(0, 0, -9)), 1e-5);
    EXPECT_LT(glm::distance(shape_of(scene, scene.instances[2]).front, dvec3(0, 0, -4)), 1e-5);
}

TEST_F(GltfAreaLight, IsNotSheared) {
    GltfBuilder b = with_lights({{{"type", "rect"}}});
    b.push("nodes", {{"scale", {2, 1, 1}}, {"children", {1}}});
    b.json["nodes"][1]["rotation"] = {0, 0, std::sin(kPi / 8), std::cos(kPi / 8)};
    const Scene scene = load(b);
    const Shape shape = shape_of(scene, scene.instances[1]);
    EXPECT_LT(glm::distance(shape.front, dvec3(0, 0, -2.5)), 1e-5) << "the node's axes have lengths of sqrt(2.5)";
    EXPECT_LT(glm::distance(shape.most, -shape.least), 2e-3);
}

TEST_F(GltfAreaLight, ReplacesOtherLightsOfItsNode) {
    GltfBuilder b = with_lights({{{"type", "disk"}}});
    b.json["extensions"]["KHR_lights_punctual"]["lights"] = {{{"type", "point"}}};
    b.json["nodes"][1]["extensions"]["KHR_lights_punctual"]["light"] = 0;
    b.require({"EXT_lights_area", "KHR_lights_punctual"});
    const Scene scene = load(b);
    EXPECT_TRUE(scene.lights.empty());
    expect_warnings(scene.report.warnings, {"nodes[1]: is a light twice"});
}

TEST_F(GltfAreaLight, OfUnusedNodesChangesNothing) {
    GltfBuilder b = with_lights({{{"type", "tube"}}, {{"type", "rect"}}});
    b.json["scene"] = 0;
    b.json["scenes"] = {{{"nodes", {0}}}};
    b.json["nodes"][1]["children"] = {2};
    b.json["nodes"][2]["children"] = {1};  // a cycle
    const Scene scene = load(b);
    EXPECT_EQ(scene.instances.size(), 1u);
    EXPECT_EQ(scene.meshes.size(), 1u);
}

TEST_F(GltfAreaLight, DamagedIsOneLine) {
    const GltfBuilder b = with_lights({{{"type", "rect"}, {"rect", Json::object()}}});
    const std::string lights = "extensions.EXT_lights_area.lights[0]";
    expect_refused(b,
                   {{"/extensions/EXT_lights_area/lights/0/type", "tube", lights + ": type 'tube' is neither"},
                    {"/extensions/EXT_lights_area/lights/0/type", 1, lights + ".type"},
                    {"/extensions/EXT_lights_area/lights/0/size", 0, lights + ": size is 0, not positive"},
                    {"/extensions/EXT_lights_area/lights/0/size", -1, lights + ": size is -1"},
                    {"/extensions/EXT_lights_area/lights/0/color", {1, 1}, lights + ".color"},
                    {"/extensions/EXT_lights_area/lights/0/rect/aspect", 0, lights + ": width by 'aspect' is 0"},
                    {"/extensions/EXT_lights_area/lights/0/rect/aspect", 1e19, lights + ": width by 'aspect' is 1e+19"},
                    {"/extensions/EXT_lights_area/lights/0/size", 1e200, lights + ": size is 1e+200"},
                    {"/nodes/1/extensions/EXT_lights_area/light", 1, "nodes[1].extensions.EXT_lights_area.light: 1"},
                    {"/nodes/1/extensions/EXT_lights_area/light", kRemoved, "nodes[1].extensions.EXT_lights_area"}});
    GltfBuilder bright = b;
    bright.json["extensions"]["EXT_lights_area"]["lights"][0].update(
        {{"intensity", -1}, {"color", {2, 0, 0}}, {"name", ""}});
    const Scene scene = load(bright);
    EXPECT_EQ(scene.materials[1].emission, vec3(0));
    expect_warnings(scene.report.warnings, {lights + ": intensity is negative"});
}

}  // namespace
}  // namespace halflight
