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
    const auto check = [&](GltfBuilder b, int indices) {
        b.json["meshes"][0]["primitives"][0]["indices"] = indices;
        const Scene scene = load(b);
        ASSERT_EQ(scene.meshes.size(), 1u);
        EXPECT_EQ(scene.meshes[0].triangles, (std::vector<uvec3>{{0, 2, 1}, {1, 2, 3}}));
        EXPECT_EQ(scene.meshes[0].positions[3], vec3(1, 1, 0));
    };
    GltfBuilder base;
    base.add_mesh({{"POSITION", base.floats("VEC3", {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0})},
                   {"NORMAL", base.floats("VEC3", {0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1})}});
    GltfBuilder b = base;
    check(b, b.accessor("SCALAR", kU8, std::vector<std::uint8_t>{0, 2, 1, 1, 2, 3}));
    b = base;
    check(b, b.accessor("SCALAR", kU16, std::vector<std::uint16_t>{0, 2, 1, 1, 2, 3}));
    b = base;
    check(b, b.accessor("SCALAR", kU32, std::vector<std::uint32_t>{0, 2, 1, 1, 2, 3}));
}

TEST_F(GltfAccessor, NormalisedIntegers) {
    GltfBuilder b;
    // Texture coordinates are unsigned 16-bit, colours unsigned 8-bit, normals signed 8-bit, positions signed 16-bit
    // numbers.
    b.add_mesh(
        {{"POSITION", b.accessor("VEC3", kI16, std::vector<std::int16_t>{0, 0, 0, 32767, 0, 0, 0, -32768, 0}, true)},
         {"NORMAL", b.accessor("VEC3", kI8, std::vector<std::int8_t>{0, 0, 127, 127, 0, 0, 0, -128, 0}, true)},
         {"TEXCOORD_0", b.accessor("VEC2", kU16, std::vector<std::uint16_t>{0, 0, 65535, 0, 13107, 65535}, true)},
         {"TEXCOORD_1", b.accessor("VEC2", kU8, std::vector<std::uint8_t>{0, 51, 102, 153, 204, 255}, true)},
         {"COLOR_0",
          b.accessor("VEC4", kU8, std::vector<std::uint8_t>{255, 0, 51, 102, 0, 0, 0, 0, 1, 2, 3, 255}, true)}});
    const Mesh mesh = load(b).meshes.at(0);
    EXPECT_EQ(mesh.positions, (std::vector<vec3>{{0, 0, 0}, {1, 0, 0}, {0, -1, 0}}));
    EXPECT_EQ(mesh.normals, (std::vector<vec3>{{0, 0, 1}, {1, 0, 0}, {0, -1, 0}}));
    EXPECT_EQ(mesh.uvs[0], (std::vector<vec2>{{0, 0}, {1, 0}, {13107 / 65535.0f, 1}}));
    EXPECT_EQ(mesh.uvs[1], (std::vector<vec2>{{0, 51 / 255.0f}, {102 / 255.0f, 153 / 255.0f}, {204 / 255.0f, 1}}));
    EXPECT_EQ(mesh.colors[0], vec4(1, 0, 51 / 255.0f, 102 / 255.0f));
    EXPECT_EQ(mesh.colors[2], vec4(1 / 255.0f, 2 / 255.0f, 3 / 255.0f, 1));
}

TEST_F(GltfAccessor, QuantisedPositionsAreExact) {
    GltfBuilder b;
    b.json["extensionsRequired"] = b.json["extensionsUsed"] = {"KHR_mesh_quantization"};
    b.add_mesh({{"POSITION", b.accessor("VEC3", kU8, std::vector<std::uint8_t>{0, 0, 0, 200, 0, 0, 0, 100, 0})}});
    EXPECT_EQ(load(b).meshes.at(0).positions, (std::vector<vec3>{{0, 0, 0}, {200, 0, 0}, {0, 100, 0}}));
}

/// Returns components of a type, as bytes padded to a stride of a multiple of four.
template <class T>
std::vector<char> padded(const std::vector<int>& values, std::size_t components) {
    const std::size_t stride = (components * sizeof(T) + 3) / 4 * 4;
    std::vector<char> bytes(values.size() / components * stride);
    for (std::size_t i = 0; i < values.size(); ++i) {
        const T value = static_cast<T>(values[i]);
        std::memcpy(&bytes[i / components * stride + i % components * sizeof(T)], &value, sizeof(T));
    }
    return bytes;
}

/// All component types of KHR_mesh_quantization, in vertices, in morph targets and below instances.
TEST_F(GltfAccessor, QuantisedAttributesOfEveryType) {
    const struct {
        const char* attribute;
        int type;
        bool normalized;
        float most;  // value of 100, or of 1 / most if normalized
    } cases[] = {{"POSITION", kI8, false, 1},    {"POSITION", kI8, true, 127},     {"POSITION", kU8, false, 1},
                 {"POSITION", kU8, true, 255},   {"POSITION", kI16, false, 1},     {"POSITION", kI16, true, 32767},
                 {"POSITION", kU16, false, 1},   {"POSITION", kU16, true, 65535},  {"NORMAL", kI8, true, 127},
                 {"NORMAL", kI16, true, 32767},  {"TANGENT", kI8, true, 127},      {"TANGENT", kI16, true, 32767},
                 {"TEXCOORD_0", kI8, false, 1},  {"TEXCOORD_0", kI8, true, 127},   {"TEXCOORD_0", kU8, false, 1},
                 {"TEXCOORD_0", kU8, true, 255}, {"TEXCOORD_0", kI16, false, 1},   {"TEXCOORD_0", kI16, true, 32767},
                 {"TEXCOORD_0", kU16, false, 1}, {"TEXCOORD_0", kU16, true, 65535}};
    for (const auto& [attribute, type, normalized, most] : cases) {
        const std::string name = attribute;
        SCOPED_TRACE(fmt::format("{} of type {}, normalized {}", name, type, normalized));
        const bool uv = name == "TEXCOORD_0", tangent = name == "TANGENT";
        const std::size_t components = uv ? 2 : tangent ? 4 : 3;
        const int unit = normalized ? static_cast<int>(most) : 100;
        std::vector<int> values(3 * components, 0), deltas(9, 0);
        for (std::size_t i = 0; i < 3; ++i) values[i * components + i % 2] = unit;
        if (tangent)
            for (const std::size_t i : {3, 7, 11}) values[i] = unit;
        deltas[8] = unit;  // the last vertex moves along z
        const auto add = [&](GltfBuilder& b, const std::vector<int>& from, std::size_t n) {
            const auto bytes = type == kI8    ? padded<std::int8_t>(from, n)
                               : type == kU8  ? padded<std::uint8_t>(from, n)
                               : type == kI16 ? padded<std::int16_t>(from, n)
                                              : padded<std::uint16_t>(from, n);
            const int view = b.view(bytes);
            b.json["bufferViews"].back()["byteStride"] = bytes.size() / 3;
            return b.push("accessors", {{"bufferView", view},
                                        {"componentType", type},
                                        {"count", 3},
                                        {"normalized", normalized},
                                        {"type", fmt::format("VEC{}", n)}});
        };
        GltfBuilder b;
        b.json["extensionsRequired"] = b.json["extensionsUsed"] = {"KHR_mesh_quantization"};
        Json& primitive = b.add_triangle();
        primitive["attributes"].update({{"NORMAL", b.floats("VEC3", {0, 0, 1, 0, 0, 1, 0, 0, 1})},
                                        {"TEXCOORD_0", b.floats("VEC2", {0, 0, 1, 0, 0, 1})},
                                        {"TANGENT", b.floats("VEC4", {1, 0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1})}});
        primitive["attributes"][name] = add(b, values, components);
        if (name == "POSITION") {  // a triangle that is not degenerate
            std::vector<int> corners{0, 0, 0, unit, 0, 0, 0, unit, 0};
            primitive["attributes"][name] = add(b, corners, 3);
        }
        if (!uv) {
            primitive["targets"] = {{{name, add(b, deltas, 3)}}};
            b.json["meshes"][0]["weights"] = {0.5};
        }
        primitive["material"] = b.push("materials", {{"normalTexture", {{"index", 0}}}});
        b.push("textures", {{"source", 0}});
        b.push("images", {{"uri",
                           "data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAIAAAABEAYAAACksqPJAAAAGklEQVR4nGP4/7+BQe"
                           "g/AwMjA8P/1Wf//wcAPtIIBqaX8jwAAAAASUVORK5CYII="}});
        b.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"]["TRANSLATION"] =
            b.floats("VEC3", {0, 0, 0, 5, 0, 0});
        const Scene scene = load(b);
        EXPECT_EQ(scene.instances.size(), 2u);
        const Mesh& mesh = scene.meshes.at(0);
        const float one = normalized ? 1 : 100;
        if (name == "POSITION") {
            EXPECT_EQ(mesh.positions, (std::vector<vec3>{{0, 0, 0}, {one, 0, 0}, {0, one, one / 2}}));
        }
        if (name == "NORMAL") {
            EXPECT_EQ(mesh.normals[1], vec3(0, 1, 0));
            EXPECT_LT(glm::distance(mesh.normals[2], glm::normalize(vec3(1, 0, 0.5f))), 1e-6f);
        }
        if (tangent) {
            EXPECT_EQ(mesh.tangents[1], vec4(0, 1, 0, 1));
            EXPECT_LT(glm::distance(vec3(mesh.tangents[2]), glm::normalize(vec3(1, 0, 0.5f))), 1e-6f);
        }
        if (uv) {
            EXPECT_EQ(mesh.uvs[0], (std::vector<vec2>{{one, 0}, {0, one}, {one, 0}}));
        }
    }
}

TEST_F(GltfAccessor, InterleavedWithAStride) {
    GltfBuilder b;
    const int view = b.view(std::vector<float>{9, 0, 0, 0, 0.5f, 0.25f, 9, 1, 0, 0, 1, 0, 9, 0, 1, 0, 0, 1});
    b.json["bufferViews"][0]["byteStride"] = 24;
    const int position =
        b.push("accessors",
               {{"bufferView", view}, {"byteOffset", 4}, {"componentType", kF32}, {"count", 3}, {"type", "VEC3"}});
    const int uv =
        b.push("accessors",
               {{"bufferView", view}, {"byteOffset", 16.0}, {"componentType", kF32}, {"count", 3}, {"type", "VEC2"}});
    b.add_mesh({{"POSITION", position}, {"TEXCOORD_0", uv}});
    const Mesh mesh = load(b).meshes.at(0);
    EXPECT_EQ(mesh.positions, kTriangle);
    EXPECT_EQ(mesh.uvs[0], (std::vector<vec2>{{0.5f, 0.25f}, {1, 0}, {0, 1}}));
}

TEST_F(GltfAccessor, Sparse) {
    for (const bool has_base : {true, false}) {
        GltfBuilder b;
        const int position = b.floats("VEC3", {0, 0, 0, 5, 0, 0, 0, 1, 0});
        if (!has_base) b.json["accessors"][0].erase("bufferView");
        b.json["accessors"][0]["sparse"] = {
            {"count", 2},
            {"indices", {{"bufferView", b.view(std::vector<std::uint16_t>{1, 2})}, {"componentType", kU16}}},
            {"values", {{"bufferView", b.view(std::vector<float>{1, 0, 0, 0, 7, 0})}}}};
        b.add_mesh({{"POSITION", position}});
        EXPECT_EQ(load(b).meshes.at(0).positions, (std::vector<vec3>{{0, 0, 0}, {1, 0, 0}, {0, 7, 0}}));
    }
}

TEST_F(GltfAccessor, ColoursWithAndWithoutAlpha) {
    GltfBuilder b;
    b.add_triangle()["attributes"]["COLOR_0"] = b.floats("VEC3", {1, 0.5f, 0, 0, 2, -1, NAN, 0, 0});
    const Scene scene = load(b);
    EXPECT_EQ(scene.meshes.at(0).colors, (std::vector<vec4>{{1, 0.5f, 0, 1}, {0, 1, 0, 1}, {1, 0, 0, 1}}));
    ASSERT_EQ(scene.report.warnings.size(), 1u);
    EXPECT_NE(scene.report.warnings[0].find("colours"), std::string::npos);
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
    EXPECT_EQ(scene.report.warnings,
              (std::vector<std::string>{"2 primitives of points are left out (--line-width draws them)",
                                        "3 primitives of lines are left out (--line-width draws them)"}));
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
    b.json["meshes"][0]["primitives"][0]["indices"] = b.accessor("SCALAR", kU8, std::vector<std::uint8_t>{0, 7});
    EXPECT_THROW(load(b, {.line_width = 1}), Error);
    // The size is known before anything is made.
    b.json["meshes"][0]["primitives"][0]["indices"] = b.accessor("SCALAR", kU8, std::vector<std::uint8_t>(1000000, 1));
    const std::filesystem::path bomb = write("bomb.glb", b.glb());
    GltfScene drawn(bomb, {.line_width = 1}), none(bomb);
    EXPECT_EQ(drawn.size().stored, 80000000u);
    EXPECT_GT(drawn.size().geometry_bytes, std::size_t{2} << 30);
    EXPECT_EQ(none.size().stored, 0u);
    b = {};
    b.add_triangle();
    EXPECT_EQ(GltfScene(write("corners.glb", b.glb())).size().vertex_texels, 3u);
    b.json["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = b.floats("VEC3", std::vector<float>(9, 0.5f));
    EXPECT_EQ(GltfScene(write("colours.glb", b.glb())).size().vertex_texels, 6u);
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
    ASSERT_EQ(scene.report.warnings.size(), 1u);
    EXPECT_TRUE(scene.report.warnings[0].ends_with("has positions that are not finite, their triangles are left out"))
        << scene.report.warnings[0];
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
