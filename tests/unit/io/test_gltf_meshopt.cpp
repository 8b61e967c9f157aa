// Tests buffer views compressed by meshoptimizer: they give what the uncompressed ones give.
#include <meshoptimizer.h>

#include <cmath>
#include <glm/gtc/quaternion.hpp>
#include <random>

#include "engine/core/memory_ledger.h"
#include "engine/io/gltf/meshopt_codec.h"
#include "engine/io/gltf/uri.h"
#include "tests/unit/io/compress_gltf.h"

namespace halflight {
namespace {

using GltfMeshopt = GltfTest;

/// Returns triangles that start with their lowest corner: the codec of triangles may rotate them.
std::vector<uvec3> rotated(std::vector<uvec3> triangles) {
    for (uvec3& t : triangles)
        while (t.x > std::min(t.y, t.z)) t = {t.y, t.z, t.x};
    return triangles;
}

struct Uses {
    int position, normal, uv, indices, strip, target, times, values, offsets;
};

/// Returns a scene whose buffer views have all uses: vertices, indices of triangles and of a strip, a morph target,
/// animation and instances.
std::pair<GltfBuilder, Uses> every_use() {
    GltfBuilder b;
    Json& grid = add_grid(b, 12);
    const Json& attributes = grid["attributes"];
    Uses uses{attributes["POSITION"], attributes["NORMAL"], attributes["TEXCOORD_0"], grid["indices"], 0, 0, 0, 0, 0};
    std::vector<std::int16_t> deltas;
    for (std::int16_t i = 0; i < 169; ++i) deltas.insert(deltas.end(), {i, 0, -1, 0});  // the last one is padding
    b.push("accessors", {{"bufferView", b.view(deltas)}, {"componentType", kI16}, {"count", 169}, {"type", "VEC3"}});
    uses.target = static_cast<int>(b.json["accessors"].size()) - 1;
    b.json["bufferViews"].back()["byteStride"] = 8;
    grid["targets"] = {{{"POSITION", uses.target}}};
    uses.strip = b.accessor("SCALAR", kU32, std::vector<std::uint32_t>{0, 1, 13, 14, 26, 27});
    b.json["meshes"][0]["primitives"].push_back(
        {{"attributes", {{"POSITION", uses.position}, {"NORMAL", uses.normal}}}, {"indices", uses.strip}, {"mode", 5}});
    b.json["meshes"][0]["weights"] = {0.5};
    uses.offsets = b.floats("VEC3", {0, 0, 0, 20, 0, 0, 0, 20, 0});
    b.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"]["TRANSLATION"] = uses.offsets;
    uses.times = b.floats("SCALAR", {0, 1, 2, 3});
    uses.values = b.floats("VEC3", {0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9});
    b.animate(0, "translation", uses.times, uses.values);
    return {b, uses};
}

GltfBuilder compressed(const char* extension = "EXT_meshopt_compression") {
    auto [b, uses] = every_use();
    for (const int accessor : {uses.position, uses.normal, uses.uv, uses.target, uses.times, uses.values, uses.offsets})
        compress_by_meshopt(b, accessor, "ATTRIBUTES", "", extension);
    compress_by_meshopt(b, uses.indices, "TRIANGLES", "", extension);
    compress_by_meshopt(b, uses.strip, "INDICES", "", extension);
    add_meshopt_buffers(b);
    b.require({extension});
    return b;
}

/// Returns the extension's object of the first compressed view, that of the positions.
Json& first(GltfBuilder& b) {
    return b.json["bufferViews"][0]["extensions"]["EXT_meshopt_compression"];
}

TEST_F(GltfMeshopt, EveryUseIsDecodedExactly) {
    for (const char* extension : {"EXT_meshopt_compression", "KHR_meshopt_compression"}) {
        const Scene plain = open(every_use().first).at(1.5, kFirst);
        GltfScene file = open(compressed(extension));
        EXPECT_GE(file.size().decoding_bytes, 169 * 32u) << "vertices, normals and texture coordinates";
        const Scene scene = file.at(1.5, kFirst);
        ASSERT_EQ(scene.meshes.size(), 1u);
        const Mesh &mesh = scene.meshes[0], &expected = plain.meshes[0];
        EXPECT_EQ(mesh.positions, expected.positions);
        EXPECT_EQ(mesh.normals, expected.normals);
        EXPECT_EQ(mesh.uvs, expected.uvs);
        EXPECT_EQ(rotated(mesh.triangles), rotated(expected.triangles));
        ASSERT_EQ(scene.instances.size(), 3u);
        for (std::size_t i = 0; i < 3; ++i)
            EXPECT_EQ(scene.instances[i].object_to_world, plain.instances[i].object_to_world);
        EXPECT_EQ(scene.report.warnings, plain.report.warnings);
        EXPECT_EQ(MemoryLedger::process().bytes(MemoryPart::scene), (4 + 12) * sizeof(float))
            << "keyframes alone are kept";
    }
}

TEST_F(GltfMeshopt, FiltersStayWithinTheirQuantisation) {
    constexpr std::size_t kCount = 64;
    std::vector<float> directions, rotations, offsets;
    std::mt19937 random(1);
    std::normal_distribution<float> normal;
    for (std::size_t i = 0; i < kCount; ++i) {
        const vec3 n = glm::normalize(vec3(normal(random), normal(random), normal(random)));
        directions.insert(directions.end(), {n.x, n.y, n.z, 1});
        const vec4 q = glm::normalize(vec4(normal(random), normal(random), normal(random), normal(random)));
        rotations.insert(rotations.end(), {q.x, q.y, q.z, q.w});
        for (int c = 0; c < 3; ++c) offsets.push_back(100 * normal(random));
    }
    for (const bool bytes : {true, false}) {
        GltfBuilder b;
        Json& primitive = b.add_mesh({});
        std::vector<std::uint16_t> order(kCount - kCount % 3);
        for (std::size_t i = 0; i < order.size(); ++i) order[i] = static_cast<std::uint16_t>(i);
        primitive["indices"] = b.accessor("SCALAR", kU16, order);
        const int position = b.floats("VEC3", offsets);
        const int type = bytes ? kI8 : kI16, stride = bytes ? 4 : 8;
        b.push("accessors", {{"bufferView", b.view(std::vector<char>(kCount * std::size_t(stride)))},
                             {"componentType", type},
                             {"count", kCount},
                             {"normalized", true},
                             {"type", "VEC3"}});
        const int direction = static_cast<int>(b.json["accessors"].size()) - 1;
        b.json["bufferViews"].back()["byteStride"] = stride;
        const int rotation = b.accessor("VEC4", kI16, std::vector<std::int16_t>(4 * kCount), true);
        primitive["attributes"] = {{"POSITION", position}, {"NORMAL", direction}};
        b.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"]["ROTATION"] = rotation;

        std::string data(kCount * std::size_t(stride), '\0');
        meshopt_encodeFilterOct(data.data(), kCount, std::size_t(stride), bytes ? 8 : 12, directions.data());
        compress_by_meshopt(b, direction, "ATTRIBUTES", data)["filter"] = "OCTAHEDRAL";
        data.assign(kCount * 8, '\0');
        meshopt_encodeFilterQuat(data.data(), kCount, 8, 12, rotations.data());
        compress_by_meshopt(b, rotation, "ATTRIBUTES", data)["filter"] = "QUATERNION";
        data.assign(kCount * 12, '\0');
#if MESHOPTIMIZER_VERSION >= 200  // earlier versions know only exponents that the components of a vector share
        meshopt_encodeFilterExp(data.data(), kCount, 12, 15, offsets.data(), meshopt_EncodeExpSharedVector);
#else
        meshopt_encodeFilterExp(data.data(), kCount, 12, 15, offsets.data());
#endif
        compress_by_meshopt(b, position, "ATTRIBUTES", data)["filter"] = "EXPONENTIAL";
        add_meshopt_buffers(b);

        const Scene scene = load(b);
        const Mesh& mesh = scene.meshes.at(0);
        ASSERT_EQ(mesh.positions.size(), order.size());
        for (std::size_t i = 0; i < order.size(); ++i) {
            const vec3 p(offsets[3 * i], offsets[3 * i + 1], offsets[3 * i + 2]);
            const vec3 n(directions[4 * i], directions[4 * i + 1], directions[4 * i + 2]);
            const float largest = std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)});
            EXPECT_LE(glm::distance(mesh.positions[i], p), 2 * largest / (1 << 13)) << "15 bits with sign, rounded";
            EXPECT_LE(glm::distance(mesh.normals[i], n), bytes ? 0.03f : 0.002f) << i;
        }
        ASSERT_EQ(scene.instances.size(), kCount);
        for (std::size_t i = 0; i < kCount; ++i) {
            const glm::dquat q(rotations[4 * i + 3], rotations[4 * i], rotations[4 * i + 1], rotations[4 * i + 2]);
            const dmat3 expected = glm::mat3_cast(q), read = dmat3(scene.instances[i].object_to_world);
            for (int column = 0; column < 3; ++column)
                EXPECT_LE(glm::distance(read[column], expected[column]), 0.003) << i;
        }
    }
}

TEST_F(GltfMeshopt, FallbacksAreReadOnlyWhenNeeded) {
    GltfBuilder b;
    add_grid(b, 4);
    compress_by_meshopt(b, 0, "ATTRIBUTES");
    add_meshopt_buffers(b);
    b.json.erase("extensionsRequired");
    b.json["buffers"][1]["uri"] = "missing.bin";
    const std::vector<vec3> positions = load(b).meshes.at(0).positions;
    EXPECT_EQ(positions.size(), 25u);

    b.json["bufferViews"][0].erase("extensions");
    EXPECT_NE(refusal(b).find("buffers[1]: "), std::string::npos);
}

/// Streams of version 1 that meshoptimizer 1.2 has encoded, at its levels 0 and 3.
struct Stream {
    const char* base64;
    std::size_t stride;
    std::string elements;  // what was encoded
};

template <class T>
std::string bytes_of(const std::vector<T>& values) {
    return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

std::vector<Stream> version_1() {
    std::vector<float> positions;
    std::vector<std::uint32_t> noise;
    for (int i = 0; i < 40; ++i)
        positions.insert(positions.end(), {float(i), 0.25f * float(i % 7), std::ldexp(float(i * i), -4)});
    for (std::uint32_t i = 0; i < 20; ++i) noise.push_back(i * 2654435761u);
    return {
        // Byte deltas of 0, 1, 2, 4 and 8 bits in all control modes
        {"oVpaVi8A//+AgEBAQEAgICAgICAgIBAQEBAQEBAQEBAQEBAQEPiIiIgAAAAAEAAGAX4CAgAAAQACDwD//4CAQECA//+AgEBAgP//gIBAQID/"
         "/4CAQECA//+A/wCAQECA//+AgASGw3wCfXwCfXyAPgD4fXx9fDgAfXwCDAAAAP///////4B/gH+Af4B/gP8Af0DAvz9AwL8PAP8A3+CQkGh4"
         "RExUPDI2Oj4gJCQoKCwkGBgaGhwcHh7/ACAQEBISEhIUAToIAIB6gAACAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA=",
         12, bytes_of(positions)},
        // Deltas of 16 bits, and rotated ones by XOR
        {"oWhpeAEGAA8fGg//+Pj0xPTE4OAQMBh4HPJi4mLyYuJiPB7d3QAA/gMHAxUQAUAFABQAUAFAAAAqD8JhP/wmE//0/vT+9MJhP/wmE//C/vT+"
         "9GE//CYAAAAA/vQBQgABAwAAAICAQMCgIBBQ0BDIaCgIhJS05KR0sqJiqvqSspqKgkHFTdlJ/VUGD/xC8mEx8THsGP4PxMcExAcDHwMRAAcB"
         "AAAAAAAAAAAAAAAAAAAAAAAAAAAAYjIy",
         12, bytes_of(positions)},
        // Literal bytes
        {"of8AnZ2dnZ2dnZ2dnZ2dnZ2dnZ2dnQDy9PTy9PTy9PTy9PTy9PT08vT0AG5ucG5wbnBucG5wbnBucG5wbnAAw8PDw8HDw8PDwcPDw8HDw8PD"
         "wQAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA==",
         4, bytes_of(noise)}};
}

std::string decoded(const char* base64) {
    return decode_data_uri(std::string("data:;base64,") + base64).value();
}

TEST_F(GltfMeshopt, Version1IsDecodedExactly) {
    for (const Stream& stream : version_1()) {
        std::string elements(stream.elements.size(), '?');
        EXPECT_TRUE(decode_meshopt_attributes(elements, stream.stride, decoded(stream.base64)));
        EXPECT_EQ(elements, stream.elements);
    }
    // A file names the stream as one of any version.
    const std::string data = decoded(version_1()[1].base64);
    GltfBuilder b;
    b.add_mesh({{"POSITION", b.floats("VEC3", std::vector<float>(3 * 39))}});
    Json view = b.json["bufferViews"][b.view(std::vector<char>(data.begin(), data.end()))];
    b.json["bufferViews"].erase(1);
    view.update({{"mode", "ATTRIBUTES"}, {"byteStride", 12}, {"count", 40}});
    b.json["bufferViews"][0].update(
        {{"buffer", 1}, {"byteOffset", 0}, {"byteLength", 480}, {"extensions", {{"KHR_meshopt_compression", view}}}});
    add_meshopt_buffers(b);
    EXPECT_EQ(load(b).meshes.at(0).positions.at(5), vec3(5, 1.25f, 25 / 16.0f));
    b.json["bufferViews"][0]["extensions"]["KHR_meshopt_compression"]["byteLength"] = data.size() - 1;
    EXPECT_TRUE(refusal(b).starts_with("bufferViews[0]: its compressed data is damaged"));
    // A count that would need gigabytes is refused before anything is allocated.
    b.json["bufferViews"][0]["extensions"]["KHR_meshopt_compression"]["count"] = 1u << 28;
    b.json["bufferViews"][0]["byteLength"] = 12ull << 28;
    b.json["accessors"][0]["count"] = 1u << 28;
    EXPECT_TRUE(refusal(b).starts_with("bufferViews[0]: 268435456 elements of 12 bytes need at least 3145753 bytes"))
        << refusal(b);
}

TEST_F(GltfMeshopt, DamagedVersion1IsRefused) {
    for (const Stream& stream : version_1()) {
        const std::string whole = decoded(stream.base64);
        std::string elements(stream.elements.size(), '?');
        const auto decodes = [&](const std::string& data) {
            return decode_meshopt_attributes(elements, stream.stride, data);
        };
        for (std::size_t length = 0; length < whole.size(); ++length) EXPECT_FALSE(decodes(whole.substr(0, length)));
        EXPECT_FALSE(decodes(whole + '\0')) << "bytes are left";
        for (const char mode : {'\3', '\x10', '\x11', '\x0f'}) {
            std::string other = whole;
            other.back() = mode;
            EXPECT_FALSE(decodes(other)) << "unknown channel mode " << int{mode};
        }
    }
}

TEST_F(GltfMeshopt, ColoursAreConverted) {
    // Four colours that meshoptimizer 1.2 has encoded with 8 and with 12 bits: red, half green, blue, and a mixture.
    const std::vector<std::uint8_t> bits8 = {64, 127, 193, 255, 127, 0, 127, 192, 64, 129, 192, 128, 128, 193, 0, 255};
    const std::vector<std::uint8_t> bits12 = {0, 4, 255, 7,   1, 252, 255, 15, 255, 7, 0, 0,   255, 7, 0,   12,
                                              0, 4, 1,   248, 0, 252, 0,   8,  0,   8, 1, 252, 0,   0, 255, 15};
    const float expected[] = {1, 0, 0, 1, 0, 1, 0, 0.5f, 0, 0, 1, 0, 0.25f, 0.5f, 0.75f, 1};
    std::string colors = bytes_of(bits8);
    decode_meshopt_colors(colors, 4);
    for (std::size_t i = 0; i < 16; ++i)
        EXPECT_NEAR(static_cast<unsigned char>(colors[i]) / 255.0f, expected[i], 2 / 255.0f) << i;
    colors = bytes_of(bits12);
    decode_meshopt_colors(colors, 8);
    for (std::size_t i = 0; i < 16; ++i) {
        std::uint16_t value = 0;
        std::memcpy(&value, &colors[2 * i], 2);
        EXPECT_NEAR(value / 65535.0f, expected[i], 2 / 4095.0f) << i;
    }
}

TEST_F(GltfMeshopt, WrongCountsAreRefused) {
    const std::pair<const char*, Json> cases[] = {
        {"byteLength", 0},
        {"byteLength", 20},
        {"byteLength", 1ull << 53},
        {"byteOffset", 1ull << 53},
        {"byteOffset", 4},
        {"byteStride", 0},
        {"byteStride", 6},
        {"byteStride", 260},
        {"byteStride", 1u << 31},
        {"byteStride", 16},
        {"count", 168},
        {"count", 1ull << 53},
        {"filter", "QUATERNION"},
        {"filter", "OCTAHEDRAL"},
        {"filter", "SQUARE"},
        {"mode", "LINES"},
        {"mode", "TRIANGLES"},
        {"buffer", 1},
        {"buffer", 2},
    };
    const std::string object = "/bufferViews/0/extensions/EXT_meshopt_compression/";
    for (const auto& [property, value] : cases)
        expect_refused(compressed(), {{object + property, value, "bufferViews[0]"}});
    expect_refused(compressed(), {{"/bufferViews/0/byteStride", 16, "bufferViews[0]: its byteStride 16"}});
    GltfBuilder same = compressed();
    same.json["bufferViews"][0]["byteStride"] = 12;
    EXPECT_EQ(refusal(same), "");
    // A count that would need gigabytes is refused before anything is allocated.
    GltfBuilder bomb = compressed();
    first(bomb)["count"] = 1u << 30;
    bomb.json["bufferViews"][0]["byteLength"] = 12ull << 30;
    bomb.json["accessors"][0]["count"] = 1u << 30;
    const std::string message = without_name(error_message([&] { open(bomb).size(); }));
    EXPECT_TRUE(message.starts_with("bufferViews[0]: 1073741824 elements of 12 bytes need at least")) << message;
}

/// Each view of the same data fits into the budget, their sum does not.
TEST_F(GltfMeshopt, ManyViewsOfOneBlockAreCounted) {
    constexpr std::size_t kViews = 1000, kBytes = 169 * sizeof(vec3);
    GltfBuilder b;
    add_grid(b, 12);
    compress_by_meshopt(b, 0, "ATTRIBUTES");
    add_meshopt_buffers(b);
    const Json view = b.json["bufferViews"][0], accessor = b.json["accessors"][0];
    for (std::size_t i = 0; i < kViews; ++i) {
        const int positions = b.push("accessors", accessor);
        b.json["accessors"][positions]["bufferView"] = b.push("bufferViews", view);
        b.json["meshes"][0]["primitives"].push_back({{"attributes", {{"POSITION", positions}}}});
    }
    const auto path = write("scene.glb", b.glb());
    EXPECT_GE(GltfScene(path).size().decoding_bytes, kViews * kBytes);
    EXPECT_EQ(refusal_with_memory(path, kViews * kBytes + (1 << 20)), "");
    const std::string message = without_name(refusal_with_memory(path, kViews * kBytes / 2));
    EXPECT_TRUE(message.starts_with("needs") && message.find("(bufferViews[") != std::string::npos) << message;
}

TEST_F(GltfMeshopt, UnusedViewsAreNotCounted) {
    const std::size_t expected = GltfScene(write("scene.glb", compressed().glb())).size().decoding_bytes;
    GltfBuilder b = compressed();
    Json view = b.json["bufferViews"][0];
    view["byteLength"] = 1ull << 53;
    view["extensions"]["EXT_meshopt_compression"].update({{"byteStride", 4}, {"count", 1ull << 51}});
    // The sizes of the views add up to 2^64. An accessor that no mesh uses does not make them loadable.
    for (int i = 0; i < 2048; ++i) b.push("bufferViews", view);
    b.push("accessors", b.json["accessors"][0]);
    b.json["accessors"].back()["bufferView"] = b.json["bufferViews"].size() - 1;
    const auto path = write("scene.glb", b.glb());
    EXPECT_EQ(GltfScene(path).size().decoding_bytes, expected);
    EXPECT_EQ(load_gltf(path).meshes.size(), 1u);
}

/// The views of meshes that deform stay decoded from pose to pose; the views of other meshes do not.
TEST_F(GltfMeshopt, ViewsOfDeformingMeshesAreKept) {
    GltfBuilder b;
    Json& grid = add_grid(b, 12);
    grid["targets"] = {{{"POSITION", grid["attributes"]["NORMAL"]}}};
    add_grid(b, 20);
    const int times = b.floats("SCALAR", {0, 1}), weights = b.floats("SCALAR", {0, 1});
    b.animate(0, "weights", times, weights);
    for (const Json& primitive : {b.json["meshes"][0]["primitives"][0], b.json["meshes"][1]["primitives"][0]})
        for (const char* name : {"POSITION", "NORMAL", "TEXCOORD_0"})
            compress_by_meshopt(b, primitive["attributes"][name], "ATTRIBUTES");
    add_meshopt_buffers(b);
    const std::size_t before = MemoryLedger::process().bytes(MemoryPart::scene);
    GltfScene file = open(b);
    const std::vector<vec3> first = file.at(0, kFirst).meshes.at(0).positions;
    EXPECT_EQ(MemoryLedger::process().bytes(MemoryPart::scene) - before, 169 * 32 + 4 * sizeof(float))
        << "vertices of the small grid, and keyframes";
    EXPECT_NE(file.at(1, kFirst).meshes.at(0).positions, first);
}

/// Views stay decoded until the last mesh in a row that shares them was read.
TEST_F(GltfMeshopt, ViewsOfTheNextMeshAreKept) {
    GltfBuilder b;
    for (const int cells : {12, 20}) {
        const Json primitive = add_grid(b, cells);
        for (const char* name : {"POSITION", "NORMAL", "TEXCOORD_0"})
            compress_by_meshopt(b, primitive["attributes"][name], "ATTRIBUTES");
        compress_by_meshopt(b, primitive["indices"], "TRIANGLES");
        b.push("nodes", {{"mesh", b.push("meshes", {{"primitives", Json::array({primitive})}})}});
    }
    add_meshopt_buffers(b);
    GltfMeshSource source(write("scene.glb", b.glb()));
    const std::size_t before = MemoryLedger::process().bytes(MemoryPart::scene);
    std::vector<std::size_t> held;
    for (const std::size_t mesh : {0, 1, 2, 3, 0, 3}) {
        source.read(mesh);
        held.push_back(MemoryLedger::process().bytes(MemoryPart::scene) - before);
    }
    constexpr std::size_t kSmall = 13 * 13 * 32 + 12 * 12 * 12, kLarge = 21 * 21 * 32 + 20 * 20 * 12;
    EXPECT_EQ(held, (std::vector<std::size_t>{kSmall, 0, kLarge, 0, kSmall, 0})) << "bytes of vertices and indices";
}

/// tests/fuzz/test_regressions.cpp changes bytes of such data.
TEST_F(GltfMeshopt, EveryTruncationIsRefused) {
    const GltfBuilder whole = compressed();
    for (std::size_t i = 0; i < whole.json["bufferViews"].size(); ++i) {
        GltfBuilder b = whole;
        Json& bytes = b.json["bufferViews"][i]["extensions"]["EXT_meshopt_compression"]["byteLength"];
        const std::size_t size = bytes;
        for (std::size_t length = 0; length < size; length += 1 + length / 4) {
            bytes = length;
            EXPECT_TRUE(refusal_in_motion(b).starts_with("bufferViews[")) << length << " bytes";
        }
    }
}

}  // namespace
}  // namespace halflight
