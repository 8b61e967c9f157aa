// Tests scenes that are invalid, and valid ones that look invalid: sizes, numbers, text, structure. Faults that need no
// limits of time and memory are in tests/unit/io/test_gltf_errors.cpp.
#include <cmath>
#include <limits>

#include "tests/cli/bad_input.h"
#include "tests/unit/io/compress_gltf.h"
#include "tests/unit/io/gltf_builder.h"

namespace halflight::test {
namespace {

class BadScenes : public CommandTest {
  protected:
    void refused(const std::string& name, const std::string& bytes, const Strings& parts) {
        write_text(file("scene.gltf"), bytes);
        expect_refused("scene: " + name, with_scene(file("scene.gltf")), words(std::string("/scene.gltf: "), parts));
    }
    void loaded(const std::string& name, const std::string& bytes) {
        write_text(file("scene.gltf"), bytes);
        expect_loaded("scene: " + name, with_scene(file("scene.gltf")));
    }

    /// Returns the glTF text of a triangle, with `value` at the JSON pointer `pointer`.
    static std::string triangle_with(const char* pointer, const Json& value) {
        GltfBuilder b;
        b.add_triangle();
        b.add_buffer();
        b.json[Json::json_pointer(pointer)] = value;
        return b.glb();
    }
    static std::string triangle_of(const char* attribute, const char* type, const std::vector<float>& components) {
        GltfBuilder b;
        b.add_triangle()["attributes"][attribute] = b.floats(type, components);
        return b.glb();
    }
};

const std::string kAsset = R"({"asset": {"version": "2.0"})";

TEST_F(BadScenes, SizesBeyondTheFile) {
    for (const std::uint64_t count : {1ull << 31, 1ull << 32, 1ull << 53, ~0ull})
        refused(fmt::format("{} vertices", count), triangle_with("/accessors/0/count", count), {"s[0]"});
    for (const char* at : {"/accessors/0/byteOffset", "/bufferViews/0/byteOffset", "/bufferViews/0/byteLength"})
        for (const std::uint64_t offset : {(1ull << 53) - 12, ~0ull - 11})
            refused(fmt::format("{} of {}", at, offset), triangle_with(at, offset),
                    {at[1] == 'a' ? "accessors[0]" : "bufferViews[0]"});
    for (const std::uint64_t stride : {253ull, ~0ull})
        refused(fmt::format("stride of {}", stride), triangle_with("/bufferViews/0/byteStride", stride),
                {"bufferViews[0]"});
    for (const std::uint64_t length : {1ull << 31, ~0ull})
        refused(fmt::format("buffer of {} bytes", length), triangle_with("/buffers/0/byteLength", length),
                {"buffers[0]"});
}

/// Lists that are long and refer to each other. Time must not grow with the product of their lengths.
TEST_F(BadScenes, LongLists) {
    const auto loaded_with = [&](const std::string& name, const auto& change) {
        GltfBuilder b;
        b.add_triangle();
        change(b);
        loaded(name, b.glb());
    };
    loaded_with("25000 unreadable images, each the fallback of the one before", [](GltfBuilder& b) {
        constexpr int kImages = 25000;
        b.json["extensionsUsed"] = {"EXT_texture_webp"};
        const Json none = {{"bufferView", b.view(std::vector<char>(4, 'x'))}, {"mimeType", "image/webp"}};
        for (int i = 0; i < kImages; ++i) {
            b.json["images"].push_back(none);
            Json texture = {{"extensions", {{"EXT_texture_webp", {{"source", i}}}}}};
            if (i + 1 < kImages) texture["source"] = i + 1;
            b.json["textures"].push_back(texture);
            b.json["materials"].push_back({{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", i}}}}}});
        }
    });
    loaded_with("40000 animations with a warning each", [](GltfBuilder& b) {
        const int times = b.floats("SCALAR", {0, 1}), values = b.floats("VEC3", {0, 0, 0, 1, 1, 1});
        for (int i = 0; i < 40000; ++i)
            b.json["animations"].push_back(
                {{"samplers", {{{"input", times}, {"output", values}}}},
                 {"channels", {{{"sampler", 0}, {"target", {{"node", 0}, {"path", fmt::format("path {}", i)}}}}}}});
    });
    loaded_with("30000 nodes that share a skin of 30000 joints", [](GltfBuilder& b) {
        constexpr int kNodes = 30000;
        Json joints = Json::array();
        b.json["nodes"][0]["skin"] = 0;
        b.json["meshes"][0]["primitives"][0]["attributes"]["JOINTS_0"] =
            b.accessor("VEC4", kU16, std::vector<std::uint16_t>(12, 0));
        b.json["meshes"][0]["primitives"][0]["attributes"]["WEIGHTS_0"] =
            b.floats("VEC4", {1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0});
        for (int i = 0; i < kNodes; ++i) {
            joints.push_back(i);
            if (i > 0) b.json["nodes"].push_back({{"mesh", 0}, {"skin", 0}});
        }
        // Without data, all matrices are zero, and nothing is left to draw.
        const int zero = b.push("accessors", {{"componentType", kF32}, {"type", "MAT4"}, {"count", kNodes}});
        b.json["skins"] = {{{"joints", joints}, {"inverseBindMatrices", zero}}};
    });
}

TEST_F(BadScenes, ClaimsOfAFewBytes) {
    const auto u32 = [](std::uint32_t v) { return std::string(reinterpret_cast<const char*>(&v), 4); };
    const std::string json = kAsset + "}  ";
    refused("1 GiB chunk", "glTF" + u32(2) + u32(1u << 30) + u32(1u << 30) + "JSON" + json, {"truncated"});
    refused("4 GiB chunk", "glTF" + u32(2) + u32(20 + 32) + u32(~0u) + "JSON" + json, {"truncated"});
    refused("chunk that ends nowhere", "glTF" + u32(2) + u32(20 + 28) + u32(~0u) + "JSON" + json, {"chunk 0"});
    refused("1 GiB in a data URI", kAsset + R"(, "buffers": [{"byteLength": 1073741824, "uri": "data:;base64,AAAA"}]})",
            {"buffers[0]", "3 bytes"});
    const std::string zeros = R"(, "accessors": [{"componentType": 5126, "type": "VEC3", "count": )";
    const std::string shown =
        R"(}], "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}], "nodes": [{"mesh": 0}]})";
    for (const char* count : {"16777216", "1073741824", "4294967295", "9007199254740992"})
        refused(std::string(count) + " zeros", kAsset + zeros + count + shown, {"s[0]"});
    const std::string instanced =
        R"(}], "meshes": [{"primitives": []}], "nodes": [{"mesh": 0, "extensions": {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 0}}}}]})";
    for (const char* count : {"16777216", "4294967296"})
        refused(std::string(count) + " instances", kAsset + zeros + count + instanced, {"accessors[0]"});
    const std::string sparse =
        R"(, "sparse": {"count": 2147483647, "indices": {"bufferView": 0, "componentType": 5121}, "values": {"bufferView": 0}}}],
        "bufferViews": [{"buffer": 0, "byteLength": 3}], "buffers": [{"byteLength": 3, "uri": "data:;base64,AAAA"}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}], "nodes": [{"mesh": 0}]})";
    refused("2^31 sparse values", kAsset + zeros + "3" + sparse, {"accessors[0].sparse"});
}

TEST_F(BadScenes, InvalidNumbers) {
    const float nan = std::nanf(""), inf = std::numeric_limits<float>::infinity(), big = 3e38f;
    for (const float x : {nan, -inf, big}) {
        const std::string value = fmt::format("{}", x);
        const std::string one = triangle_of("POSITION", "VEC3", {x, 0, 0, 1, 0, 0, 0, 1, 0});
        x == big ? refused("position of " + value, one, {"nodes[0]"}) : loaded("position of " + value, one);
        loaded("all positions of " + value, triangle_of("POSITION", "VEC3", std::vector<float>(9, x)));
        loaded("normals of " + value, triangle_of("NORMAL", "VEC3", std::vector<float>(9, x)));
        loaded("texture coordinates of " + value, triangle_of("TEXCOORD_0", "VEC2", std::vector<float>(6, x)));
        loaded("colours of " + value, triangle_of("COLOR_0", "VEC4", std::vector<float>(12, x)));
    }
    for (const float x : {nan, inf}) {
        GltfBuilder b;
        Json& primitive = b.add_triangle();
        primitive["attributes"]["JOINTS_0"] = b.accessor("VEC4", kU8, std::vector<std::uint8_t>(12, 0));
        primitive["attributes"]["WEIGHTS_0"] = b.floats("VEC4", std::vector<float>(12, x));
        b.push("skins", {{"joints", {0}}, {"inverseBindMatrices", b.floats("MAT4", std::vector<float>(16, x))}});
        b.json["nodes"][0]["skin"] = 0;
        loaded(fmt::format("skin of {}", x), b.glb());
        b = {};
        b.add_triangle();
        b.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"]["TRANSLATION"] =
            b.floats("VEC3", {0, x, 0});
        refused(fmt::format("instance at {}", x), b.glb(), {"nodes[0]"});
    }
    refused("NaN in JSON", kAsset + R"(, "nodes": [{"translation": [NaN, 0, 0]}]})", {"parse error"});
    refused("1e999 in JSON", kAsset + R"(, "nodes": [{"translation": [1e999, 0, 0]}]})", {"overflow"});
    refused("translation of 1e300", triangle_with("/nodes/0/translation", {1e300, 0, 0}), {"nodes[0]"});
    refused("matrix of 1e300", triangle_with("/nodes/0/matrix", std::vector<double>(16, 1e300)), {"nodes[0]"});
    loaded("matrix of zeros", triangle_with("/nodes/0/matrix", std::vector<double>(16, 0)));
    loaded("scale of 0", triangle_with("/nodes/0/scale", {0, 0, 0}));
    loaded("scale of 1e-300", triangle_with("/nodes/0/scale", {1e-300, 1e-300, 1e-300}));
    loaded("rotation of 0", triangle_with("/nodes/0/rotation", {0, 0, 0, 0}));
    loaded("rotation of 1e300", triangle_with("/nodes/0/rotation", {1e300, 1e300, 0, 0}));
    loaded("far away", triangle_with("/nodes/0/translation", {1e12, 0, 0}));
    loaded("huge", triangle_with("/nodes/0/scale", {1e11, 1e11, 1e11}));
    refused("too huge", triangle_with("/nodes/0/scale", {1e30, 1e30, 1e30}), {"nodes[0]"});
}

TEST_F(BadScenes, Nodes) {
    const auto nodes = [](const Json& list) {
        GltfBuilder b;
        b.add_triangle();
        b.json["nodes"] = list;
        return b.glb();
    };
    constexpr int kMany = 100000;
    Json circle = Json::array(), deep = Json::array(), row = Json::array();
    for (int i = 0; i < kMany; ++i) {
        circle.push_back({{"children", {(i + 1) % kMany}}});
        deep.push_back(i + 1 < kMany ? Json{{"children", {i + 1}}} : Json{{"mesh", 0}});
        for (int k = 0; k < 2; ++k) row.push_back({{"mesh", 0}, {"translation", {2 * i + k, 0, 0}}});
    }
    refused("node that is its own child", nodes(Json::parse(R"([{"children": [0]}])")), {"nodes[0]"});
    refused("nodes in a circle", nodes(Json::parse(R"([{"children": [1]}, {"children": [2]}, {"children": [0]}])")),
            {"nodes[0]"});
    refused("circle of 100000", nodes(circle), {"nodes[0]"});
    refused("node with two parents", nodes(Json::parse(R"([{"children": [2]}, {"children": [2]}, {"mesh": 0}])")),
            {"nodes[2]"});
    refused("child 2^32 - 1", nodes(Json::parse(R"([{"children": [4294967295]}])")), {"nodes[0].children[0]"});
    loaded("100000 nodes deep", nodes(deep));
    loaded("1000000 nodes of nothing", nodes(std::vector<Json>(1000000, Json::object())));
    loaded("200000 nodes of one mesh", nodes(row));
    GltfBuilder b;
    for (int i = 0; i < 20000; ++i) {
        b.push("cameras", {{"type", "perspective"}, {"perspective", {{"yfov", 1}, {"znear", 1}}}});
        b.push("nodes", {{"camera", i}});
    }
    loaded("20000 cameras", b.glb());
}

TEST_F(BadScenes, Text) {
    for (const char* bracket : {"[", "{\"a\":"}) {
        std::string deep;
        for (int i = 0; i < 100000; ++i) deep += bracket;
        refused(fmt::format("100000 times {}", bracket), kAsset + R"(, "extras": )" + deep, {"nested"});
        refused(fmt::format("100000 times {} alone", bracket), "{\"a\":" + deep, {"nested"});
    }
    refused("byte that is not UTF-8", kAsset + ", \"nodes\": [{\"name\": \"\xff\xfe\"}]}", {"UTF-8"});
    refused("lone surrogate", kAsset + R"(, "nodes": [{"name": "\ud800"}]})", {"surrogate"});
    refused("UTF-16", std::string("\xff\xfe{\0", 4), {"neither"});
    refused("NUL", kAsset + std::string("\0", 1) + "}", {"parse error"});
    loaded("name with line ends", kAsset + R"(, "nodes": [{"name": "a\nb\r\u001b[31mc"}]})");
    refused("line ends in an extension", kAsset + R"(, "extensionsRequired": ["a\nb\u001b[31m"]})", {"a", "b"});
    refused("a million keys that are not closed",
            kAsset + ", " +
                [] {
                    std::string keys;
                    for (int i = 0; i < 1000000; ++i) keys += fmt::format("\"{}\":0,", i);
                    return keys;
                }(),
            {"parse error"});
    loaded("name of 10 MB", kAsset + R"(, "nodes": [{"name": ")" + std::string(10000000, 'n') + R"("}]})");
    const std::string doubled = kAsset + R"(, "accessors": [{"componentType": 5126, "count": 3, "type": "VEC3"}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 7, "POSITION": 0}}]}], "nodes": [{"mesh": 0}]})";
    loaded("attribute twice: the last one counts, as in JSON.parse", doubled);
}

/// Counts of compressed data that the file cannot hold, alone and together with the counts of accessors.
TEST_F(BadScenes, CompressedBombs) {
    GltfBuilder meshopt;
    add_grid(meshopt, 12);
    compress_by_meshopt(meshopt, 0, "ATTRIBUTES");
    add_meshopt_buffers(meshopt);
    loaded("meshopt", meshopt.glb());
    const Json::json_pointer view("/bufferViews/0"), data("/bufferViews/0/extensions/EXT_meshopt_compression");
    for (const std::uint64_t count : {1ull << 16, 1ull << 28, 1ull << 40, 1ull << 49}) {
        GltfBuilder b = meshopt;
        b.json[data]["count"] = count;
        b.json[view]["byteLength"] = 12 * count;
        b.json["accessors"][0]["count"] = count;
        refused(fmt::format("meshopt of {} vertices", count), b.glb(), {"bufferViews[0]", "compressed data"});
    }
    GltfBuilder unused = meshopt;
    unused.json["bufferViews"].push_back(meshopt.json[view]);
    unused.json["bufferViews"].back()["byteLength"] = 12ull << 49;
    unused.json["bufferViews"].back()["extensions"]["EXT_meshopt_compression"]["count"] = 1ull << 49;
    loaded("meshopt with 2^49 vertices in a view that nothing uses", unused.glb());

    GltfBuilder draco;
    compress_by_draco(draco, add_grid(draco, 12));
    loaded("Draco", draco.glb());
    for (const std::uint64_t count : {3ull << 16, 3ull << 28, 3ull << 40}) {
        GltfBuilder b = draco;
        for (Json& accessor : b.json["accessors"]) accessor["count"] = count;
        loaded(fmt::format("Draco with accessors of {} elements", count), b.glb());
    }
    const Json object = draco.json["meshes"][0]["primitives"][0]["extensions"]["KHR_draco_mesh_compression"];
    const std::size_t offset = draco.json["bufferViews"][object["bufferView"].get<int>()]["byteOffset"];
    for (Json& accessor : draco.json["accessors"]) accessor["count"] = 3u << 28;
    for (const char* number : {"\xff\xff\x3f", "\xff\xff\xff\x7f"}) {
        std::string glb = draco.glb();
        const std::size_t counts = glb.size() - (draco.bytes().size() + 3) / 4 * 4 + offset + 12;
        glb.replace(counts, 2 * std::strlen(number), std::string(number) + number);
        refused(fmt::format("Draco with {} bytes of count", std::strlen(number)), glb, {"meshes[0].primitives[0]"});
    }
}

}  // namespace
}  // namespace halflight::test
