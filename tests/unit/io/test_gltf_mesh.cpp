// Tests meshes of glTF files: accessors and primitive modes.
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

#include "tests/unit/io/gltf_builder.h"

namespace halflight {
namespace {

const std::vector<vec3> kTriangle{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};

using GltfAccessor = GltfTest;
using GltfPrimitive = GltfTest;

TEST_F(GltfAccessor, IndicesOfEveryType) {
    GltfBuilder b;
    Json& primitive = b.add_mesh({{"POSITION", b.floats("VEC3", {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0})},
                                  {"NORMAL", b.floats("VEC3", {0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1})}});
    for (const int indices : {b.accessor("SCALAR", kU8, std::vector<std::uint8_t>{0, 2, 1, 1, 2, 3}),
                              b.accessor("SCALAR", kU16, std::vector<std::uint16_t>{0, 2, 1, 1, 2, 3}),
                              b.accessor("SCALAR", kU32, std::vector<std::uint32_t>{0, 2, 1, 1, 2, 3})}) {
        primitive["indices"] = indices;
        const Scene scene = load(b);
        ASSERT_EQ(scene.meshes.size(), 1u);
        EXPECT_EQ(scene.meshes[0].triangles, (std::vector<uvec3>{{0, 2, 1}, {1, 2, 3}}));
        EXPECT_EQ(scene.meshes[0].positions[3], vec3(1, 1, 0));
    }
}

/// The least signed number is -1, too.
TEST_F(GltfAccessor, NormalisedIntegers) {
    GltfBuilder b;
    b.add_mesh(
        {{"POSITION", b.accessor("VEC3", kI16, std::vector<std::int16_t>{0, 0, 0, 32767, 0, 0, 0, -32768, 0}, true)},
         {"NORMAL", b.accessor("VEC3", kI8, std::vector<std::int8_t>{0, 0, 127, 127, 0, 0, 0, -128, 0}, true)},
         {"COLOR_0",
          b.accessor("VEC4", kU8, std::vector<std::uint8_t>{255, 0, 51, 102, 0, 0, 0, 0, 1, 2, 3, 255}, true)}});
    const Mesh mesh = load(b).meshes.at(0);
    EXPECT_EQ(mesh.positions, (std::vector<vec3>{{0, 0, 0}, {1, 0, 0}, {0, -1, 0}}));
    EXPECT_EQ(mesh.normals, (std::vector<vec3>{{0, 0, 1}, {1, 0, 0}, {0, -1, 0}}));
    EXPECT_EQ(mesh.colors[0], vec4(1, 0, 51 / 255.0f, 102 / 255.0f));
    EXPECT_EQ(mesh.colors[2], vec4(1 / 255.0f, 2 / 255.0f, 3 / 255.0f, 1));
}

/// All component types of KHR_mesh_quantization, in vertices, in morph targets and below instances.
TEST_F(GltfAccessor, QuantisedAttributesOfEveryType) {
    const std::map<int, int> largest = {{kI8, 127}, {kU8, 255}, {kI16, 32767}, {kU16, 65535}};
    const struct {
        std::string name;
        int type;
        bool normalized;
    } cases[] = {{"POSITION", kI8, false},    {"POSITION", kI8, true},     {"POSITION", kU8, false},
                 {"POSITION", kU8, true},     {"POSITION", kI16, false},   {"POSITION", kI16, true},
                 {"POSITION", kU16, false},   {"POSITION", kU16, true},    {"NORMAL", kI8, true},
                 {"NORMAL", kI16, true},      {"TANGENT", kI8, true},      {"TANGENT", kI16, true},
                 {"TEXCOORD_0", kI8, false},  {"TEXCOORD_0", kI8, true},   {"TEXCOORD_0", kU8, false},
                 {"TEXCOORD_0", kU8, true},   {"TEXCOORD_0", kI16, false}, {"TEXCOORD_0", kI16, true},
                 {"TEXCOORD_0", kU16, false}, {"TEXCOORD_0", kU16, true}};
    for (const auto& [name, type, normalized] : cases) {
        SCOPED_TRACE(fmt::format("{} of type {}, normalized {}", name, type, normalized));
        const bool uv = name == "TEXCOORD_0", tangent = name == "TANGENT";
        const std::size_t components = uv ? 2 : tangent ? 4 : 3;
        const int unit = largest.at(type);
        std::vector<int> values(3 * components, 0), deltas(9, 0);
        for (std::size_t i = 0; i < 3; ++i) values[i * components + i % 2] = unit;
        if (tangent)
            for (const std::size_t i : {3, 7, 11}) values[i] = unit;
        deltas[8] = unit;  // the last vertex moves along z
        GltfBuilder b;
        const auto add = [&](const std::vector<int>& from, std::size_t n) {
            const auto as = [&](auto zero) {
                const std::vector<decltype(zero)> numbers(from.begin(), from.end());
                return b.accessor(fmt::format("VEC{}", n).c_str(), type, numbers, normalized);
            };
            return type == kI8    ? as(std::int8_t{})
                   : type == kU8  ? as(std::uint8_t{})
                   : type == kI16 ? as(std::int16_t{})
                                  : as(std::uint16_t{});
        };
        b.require({"KHR_mesh_quantization"});
        Json& primitive = b.add_triangle();
        primitive["attributes"].update({{"NORMAL", b.floats("VEC3", {0, 0, 1, 0, 0, 1, 0, 0, 1})},
                                        {"TEXCOORD_0", b.floats("VEC2", {0, 0, 1, 0, 0, 1})},
                                        {"TANGENT", b.floats("VEC4", {1, 0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1})}});
        if (name == "POSITION") values = {0, 0, 0, unit, 0, 0, 0, unit, 0};  // a triangle that is not degenerate
        primitive["attributes"][name] = add(values, components);
        if (!uv) {
            primitive["targets"] = {{{name, add(deltas, 3)}}};
            b.json["meshes"][0]["weights"] = {0.5};
        }
        primitive["material"] = b.push("materials", {{"normalTexture", {{"index", 0}}}});
        b.push("textures", {{"source", b.push("images", {{"uri", kPng16}})}});
        b.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"]["TRANSLATION"] =
            b.floats("VEC3", {0, 0, 0, 5, 0, 0});
        const Scene scene = load(b);
        EXPECT_EQ(scene.instances.size(), 2u);
        const Mesh& mesh = scene.meshes.at(0);
        const float one = normalized ? 1 : static_cast<float>(unit);
        if (name == "POSITION") {
            EXPECT_EQ(mesh.positions, (std::vector<vec3>{{0, 0, 0}, {one, 0, 0}, {0, one, one / 2}}));
        } else if (uv) {
            EXPECT_EQ(mesh.uvs[0], (std::vector<vec2>{{one, 0}, {0, one}, {one, 0}}));
        } else {
            EXPECT_EQ(tangent ? mesh.tangents[1] : vec4(mesh.normals[1], 1), vec4(0, 1, 0, 1));
            const vec3 moved = tangent ? vec3(mesh.tangents[2]) : mesh.normals[2];
            EXPECT_LT(glm::distance(moved, glm::normalize(vec3(1, 0, 0.5f))), 1e-6f);
        }
    }
}

TEST_F(GltfAccessor, InterleavedWithAStride) {
    GltfBuilder b;
    const int view = b.view(std::vector<float>{9, 0, 0, 0, 0.5f, 0.25f, 9, 1, 0, 0, 1, 0, 9, 0, 1, 0, 0, 1});
    b.json["bufferViews"][0]["byteStride"] = 24;
    Json accessor = {{"bufferView", view}, {"byteOffset", 4}, {"componentType", kF32}, {"count", 3}, {"type", "VEC3"}};
    const int position = b.push("accessors", accessor);
    accessor.update({{"byteOffset", 16.0}, {"type", "VEC2"}});
    b.add_mesh({{"POSITION", position}, {"TEXCOORD_0", b.push("accessors", accessor)}});
    const Mesh mesh = load(b).meshes.at(0);
    EXPECT_EQ(mesh.positions, kTriangle);
    EXPECT_EQ(mesh.uvs[0], (std::vector<vec2>{{0.5f, 0.25f}, {1, 0}, {0, 1}}));
}

TEST_F(GltfAccessor, Sparse) {
    GltfBuilder b;
    const int position = b.floats("VEC3", {0, 0, 0, 5, 0, 0, 0, 1, 0});
    b.add_mesh({{"POSITION", position}});
    b.json["accessors"][0]["sparse"] = {
        {"count", 2},
        {"indices", {{"bufferView", b.view(std::vector<std::uint16_t>{1, 2})}, {"componentType", kU16}}},
        {"values", {{"bufferView", b.view(std::vector<float>{1, 0, 0, 0, 7, 0})}}}};
    for (int i = 0; i < 2; ++i, b.json["accessors"][0].erase("bufferView"))
        EXPECT_EQ(load(b).meshes.at(0).positions, (std::vector<vec3>{{0, 0, 0}, {1, 0, 0}, {0, 7, 0}})) << i;
}

TEST_F(GltfAccessor, ColoursWithAndWithoutAlpha) {
    GltfBuilder b;
    b.add_triangle()["attributes"]["COLOR_0"] = b.floats("VEC3", {1, 0.5f, 0, 0, 2, -1, NAN, 0, 0});
    const Scene scene = load(b);
    EXPECT_EQ(scene.meshes.at(0).colors, (std::vector<vec4>{{1, 0.5f, 0, 1}, {0, 1, 0, 1}, {1, 0, 0, 1}}));
    EXPECT_EQ(scene.report.warnings.size(), 1u);
}

TEST_F(GltfPrimitive, Modes) {
    // Five vertices form a zigzag (strip), or surround the first one (fan).
    const struct {
        int mode;
        std::vector<uvec3> triangles;
    } cases[] = {
        {4, {{0, 1, 2}}},  // two vertices are left over
        {5, {{0, 1, 2}, {1, 3, 2}, {2, 3, 4}}},
        {6, {{1, 2, 0}, {2, 3, 0}, {3, 4, 0}}},
    };
    for (const auto& [mode, expected] : cases) {
        GltfBuilder b;
        b.add_mesh({{"POSITION", b.floats("VEC3", {0, 0, 0, 1, 0, 0, 0, 1, 1, 1, 1, 0, 0, 2, 0})},
                    {"NORMAL", b.floats("VEC3", {0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1})}})["mode"] = mode;
        EXPECT_EQ(load(b).meshes.at(0).triangles, expected) << mode;
    }
}

TEST_F(GltfPrimitive, TheLargestIndexRestartsJoinedPrimitives) {
    const auto made = [&](int mode, int type, const auto& indices, const char* extension, double line_width = 0) {
        GltfBuilder b;
        Json& primitive = b.add_mesh(
            {{"POSITION", b.floats("VEC3", {0, 0, 0, 1, 0, 0, 0, 1, 1, 1, 1, 0, 0, 2, 0, 5, 5, 5, 6, 5, 5})}});
        primitive["mode"] = mode;
        primitive["indices"] = b.accessor("SCALAR", type, indices);
        b.require({extension});
        return load(b, {.line_width = line_width});
    };
    const char* const name = "KHR_mesh_primitive_restart";
    using U8 = std::vector<std::uint8_t>;
    const std::vector<vec3> strip =
        made(5, kU8, U8{0, 1, 2, 3, 255, 255, 6, 255, 2, 3, 4, 255}, name).meshes.at(0).positions;
    const std::vector<vec3> plain =
        made(4, kU8, U8{0, 1, 2, 1, 3, 2, 2, 3, 4}, "KHR_mesh_quantization").meshes.at(0).positions;
    EXPECT_EQ(strip, plain) << "two strips, and a corner alone";
    const auto fans = std::vector<std::uint16_t>{0, 1, 2, 3, 65535, 4, 3, 2};
    EXPECT_EQ(made(6, kU16, fans, name).meshes.at(0).triangles.size(), 3u);
    const auto large = std::vector<std::uint32_t>{4294967295u, 0, 1, 2, 4294967295u};
    EXPECT_EQ(made(5, kU32, large, name).meshes.at(0).triangles.size(), 1u);
    // Lines: two strips of one and of two segments; loops close each on its own, if they have three corners.
    EXPECT_EQ(made(3, kU8, U8{0, 1, 255, 2, 3, 4}, name, 0.1).report.line_segments_drawn, 3u);
    EXPECT_EQ(made(2, kU8, U8{0, 1, 255, 2, 3, 4}, name, 0.1).report.line_segments_drawn, 4u);
    // Lists of triangles have no restarts, and other files neither.
    EXPECT_NE(error_message([&] { made(4, kU8, U8{0, 1, 255}, name); }), "");
    EXPECT_NE(error_message([&] { made(5, kU8, U8{0, 1, 2, 255, 0, 1, 2}, "KHR_mesh_quantization"); }), "");
    // Groups of EXT_mesh_primitive_restart name primitives that are there one by one.
    GltfBuilder b;
    b.add_triangle();
    b.json["meshes"][0]["primitives"].push_back(b.primitive());
    b.json["meshes"][0]["extensions"]["EXT_mesh_primitive_restart"]["primitiveGroups"] = {
        {{"primitives", {0, 1}}, {"indices", 0}}};
    b.require({"EXT_mesh_primitive_restart"});
    const Scene scene = load(b);
    EXPECT_EQ(scene.meshes.at(0).triangles.size(), 2u);
    EXPECT_TRUE(scene.report.warnings.empty());
}

TEST_F(GltfPrimitive, PointsAndLinesAreIgnoredAndReported) {
    GltfBuilder b;
    b.add_triangle();
    Json& primitives = b.json["meshes"][0]["primitives"];
    for (const int mode : {0, 0, 1, 2, 3}) {
        primitives.push_back(primitives[0]);
        primitives.back()["mode"] = mode;
    }
    const Scene scene = load(b);
    EXPECT_EQ(scene.meshes.at(0).triangles.size(), 1u);
    EXPECT_EQ(scene.report.point_primitives_skipped, 2u);
    EXPECT_EQ(scene.report.line_primitives_skipped, 3u);
    EXPECT_EQ(scene.report.warnings.size(), 2u) << "of points and of lines";
}

/// Returns six times the volume inside a mesh; expects that each edge, by positions, lies between two triangles.
double closed_volume(const Mesh& mesh) {
    using Point = std::array<float, 3>;
    std::map<std::pair<Point, Point>, int> open;
    double volume = 0;
    for (const uvec3& t : mesh.triangles) {
        const vec3 corners[] = {mesh.positions[t.x], mesh.positions[t.y], mesh.positions[t.z]};
        volume += glm::dot(dvec3(corners[0]), glm::cross(dvec3(corners[1]), dvec3(corners[2])));
        for (int k = 0; k < 3; ++k) {
            const vec3 &a = corners[k], &b = corners[(k + 1) % 3];
            const Point from{a.x, a.y, a.z}, to{b.x, b.y, b.z};
            ++open[{from, to}];
            --open[{to, from}];
        }
    }
    for (const auto& [edge, count] : open) EXPECT_EQ(count, 0);
    return volume;
}

TEST_F(GltfPrimitive, PointsAndLinesAreDrawnWithAWidth) {
    const std::vector<vec3> corners{{0, 0, 0}, {4, 0, 0}, {4, 3, 0}, {4, 3, 0}, {0, 0, 5}};
    const struct {
        int mode;
        std::size_t points, segments;
    } cases[] = {{0, 5, 0}, {1, 0, 2}, {2, 0, 5}, {3, 0, 4}};  // the last corner of LINES is left over
    for (const auto& [mode, points, segments] : cases) {
        GltfBuilder b;
        std::vector<float> numbers, colors;
        for (std::size_t i = 0; i < corners.size(); ++i) {
            numbers.insert(numbers.end(), {corners[i].x, corners[i].y, corners[i].z});
            colors.insert(colors.end(), {0.2f * static_cast<float>(i), 1, 0});
        }
        b.add_mesh({{"POSITION", b.floats("VEC3", numbers)}, {"COLOR_0", b.floats("VEC3", colors)}})["mode"] = mode;
        b.json["nodes"][0]["scale"] = {2, 2, 2};
        b.push("nodes", {{"mesh", 0}});
        const Scene scene = load(b, {.line_width = 0.4});
        ASSERT_EQ(scene.meshes.size(), 1u) << mode;
        EXPECT_EQ(scene.instances.size(), 2u);
        EXPECT_EQ(scene.report.points_drawn, points);
        EXPECT_EQ(scene.report.line_segments_drawn, segments);
        EXPECT_EQ(scene.report.warnings.size(), mode == 1 ? 1u : 0u);
        const Mesh& mesh = scene.meshes[0];
        EXPECT_GT(closed_volume(mesh), 0) << "faces face outwards";
        for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
            // The first node doubles lengths, so a diameter of 0.4 in the world is a radius of 0.1 here.
            const auto source = static_cast<std::size_t>(std::lround(mesh.colors[i].r / 0.2f));
            EXPECT_LT(glm::distance(mesh.positions[i], corners[source] + 0.1f * mesh.normals[i]), 1e-6f);
            EXPECT_NEAR(glm::length(mesh.normals[i]), 1, 1e-6);
        }
    }
}

TEST_F(GltfPrimitive, LinesFollowMorphTargets) {
    GltfBuilder b;
    Json& line = b.add_mesh({{"POSITION", b.floats("VEC3", {0, 0, 0, 1, 0, 0})}});
    line["mode"] = 3;
    line["targets"] = {{{"POSITION", b.floats("VEC3", {0, 0, 0, 0, 2, 0})}}};
    b.json["meshes"][0]["weights"] = {0.5};
    const Mesh mesh = load(b, {.line_width = 0.2}).meshes.at(0);
    vec3 lower(1e9f), upper(-1e9f);
    for (const vec3& p : mesh.positions) lower = glm::min(lower, p), upper = glm::max(upper, p);
    EXPECT_NEAR(upper.y, 1.1, 0.02) << "the second end has moved up by 1";
    EXPECT_NEAR(lower.y, -0.1, 0.02);
}

TEST_F(GltfPrimitive, PointsAndLinesThatCannotBeDrawn) {
    GltfBuilder b;
    b.add_mesh({{"POSITION", b.floats("VEC3", {0, 0, 0, NAN, 0, 0, 1, 0, 0, 1e30f, 1e30f, 0})}})["mode"] = 3;
    const Scene odd = load(b, {.line_width = 1});
    EXPECT_GT(odd.report.non_finite_triangles_dropped, 0u);
    for (const Mesh& mesh : odd.meshes)
        for (const vec3& p : mesh.positions) EXPECT_TRUE(all_finite(p));
    b = {};
    b.add_mesh({{"POSITION", b.floats("VEC3", {0, 0, 0})}})["mode"] = 3;
    EXPECT_TRUE(load(b, {.line_width = 1}).meshes.empty()) << "one corner is no line";
    b = {};
    b.add_mesh({{"POSITION", b.floats("VEC3", {0, 0, 0, 1, 0, 0})}})["mode"] = 0;
    b.primitive()["indices"] = b.accessor("SCALAR", kU8, std::vector<std::uint8_t>{0, 7});
    EXPECT_THROW(load(b, {.line_width = 1}), Error);
    // The size is known before anything is made.
    b.primitive()["indices"] = b.accessor("SCALAR", kU8, std::vector<std::uint8_t>(1000000, 1));
    const std::filesystem::path bomb = write("bomb.glb", b.glb());
    GltfScene drawn(bomb, {.line_width = 1}), none(bomb);
    EXPECT_EQ(drawn.size().stored, 80000000u);
    EXPECT_GT(drawn.size().geometry_bytes, std::size_t{2} << 30);
    EXPECT_EQ(none.size().stored, 0u);
    b = {};
    b.add_triangle();
    EXPECT_EQ(open(b).size().vertex_texels, 3u);
    b.primitive()["attributes"]["COLOR_0"] = b.floats("VEC3", std::vector<float>(9, 0.5f));
    EXPECT_EQ(open(b).size().vertex_texels, 6u);
}

TEST_F(GltfPrimitive, DegenerateTrianglesAreDroppedAndCounted) {
    GltfBuilder b;
    b.add_mesh({{"POSITION", b.floats("VEC3", {0, 0, 0, 1, 0, 0, 0, 1,   0,  // valid
                                               0, 0, 0, 1, 0, 0, 2, 0,   0,  // collinear
                                               3, 3, 3, 3, 3, 3, 0, 1,   0,  // two equal corners
                                               0, 0, 0, 1, 0, 0, 0, NAN, 0})}});
    const Scene scene = load(b);
    EXPECT_EQ(scene.meshes.at(0).triangles.size(), 1u);
    EXPECT_EQ(scene.meshes[0].positions, kTriangle);
    EXPECT_EQ(scene.report.degenerate_triangles_dropped, 2u);
    EXPECT_EQ(scene.report.non_finite_triangles_dropped, 1u);
    EXPECT_EQ(scene.report.warnings.size(), 1u);
}

TEST_F(GltfPrimitive, NormalsAreGeneratedOrRepaired) {
    GltfBuilder b;
    b.add_triangle();
    Scene scene = load(b);
    EXPECT_EQ(scene.meshes.at(0).normals, std::vector<vec3>(3, {0, 0, 1}));
    EXPECT_EQ(scene.report.normals_generated, 3u);
    b = {};
    b.add_triangle()["attributes"]["NORMAL"] = b.floats("VEC3", {0, 3, 0, 0, 0, 0, INFINITY, 0, 0});
    scene = load(b);
    EXPECT_EQ(scene.meshes.at(0).normals, (std::vector<vec3>{{0, 1, 0}, {0, 0, 1}, {0, 0, 1}}));
    EXPECT_EQ(scene.report.normals_generated, 2u);
}

TEST_F(GltfPrimitive, OnlyUsedVerticesAreKept) {
    GltfBuilder b;
    Json& primitive =
        b.add_mesh({{"POSITION", b.floats("VEC3", {9, 9, 9, 0, 0, 0, 8, 8, 8, 1, 0, 0, 0, 1, 0, NAN, 7, 7})}});
    primitive["indices"] = b.accessor("SCALAR", kU8, std::vector<std::uint8_t>{1, 3, 4});
    EXPECT_EQ(load(b).meshes.at(0).positions, kTriangle);
}

TEST_F(GltfPrimitive, AMeshHasAllItsPrimitives) {
    GltfBuilder b;
    b.push("materials", {{"name", "red"}});
    Json& first = b.add_triangle();
    first["attributes"]["COLOR_0"] = b.floats("VEC3", {0, 0, 0, 0, 0, 0, 0, 0, 0});
    Json second = first;
    second["material"] = 0;
    second["attributes"].erase("COLOR_0");
    b.json["meshes"][0]["primitives"].push_back(second);
    const Scene scene = load(b);
    const Mesh& mesh = scene.meshes.at(0);
    EXPECT_EQ(mesh.triangles, (std::vector<uvec3>{{0, 1, 2}, {3, 4, 5}}));
    EXPECT_EQ(mesh.triangle_material, (std::vector<std::uint32_t>{1, 0}));
    ASSERT_EQ(scene.materials.size(), 2u) << "one more, for triangles that have none";
    EXPECT_EQ(scene.materials[1].name, "default");
    EXPECT_EQ(mesh.colors[0], vec4(0, 0, 0, 1));
    EXPECT_EQ(mesh.colors[5], vec4(1));
}

}  // namespace
}  // namespace halflight
