// Tests primitives compressed by Draco: they give the uncompressed geometry within the quantisation.
#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "engine/io/gltf/primitive.h"
#include "tests/unit/io/compress_gltf.h"

namespace halflight {
namespace {

namespace fs = std::filesystem;

using GltfDraco = GltfTest;

constexpr int kSide = 12;  // quads along an edge of the grid

/// Returns the number of a vertex of add_grid(), from its position.
std::uint32_t place_of(const vec3& position) {
    return static_cast<std::uint32_t>(std::lround(position.y) * (kSide + 1) + std::lround(position.x));
}

/// Returns the triangles with the numbers of place_of(), each with its lowest corner first, in sorted order.
std::vector<std::array<std::uint32_t, 3>> triangles_by_place(const Mesh& mesh) {
    std::vector<std::array<std::uint32_t, 3>> triangles;
    for (const uvec3& t : mesh.triangles) {
        std::array<std::uint32_t, 3> places{};
        for (int i = 0; i < 3; ++i) places[std::size_t(i)] = place_of(mesh.positions[t[i]]);
        std::ranges::rotate(places, std::ranges::min_element(places));
        triangles.push_back(places);
    }
    std::ranges::sort(triangles);
    return triangles;
}

/// Expects the same triangles, with attributes that differ by at most half a step of quantisation.
void expect_same(const Mesh& mesh, const Mesh& expected, int bits) {
    EXPECT_EQ(triangles_by_place(mesh), triangles_by_place(expected));
    ASSERT_EQ(mesh.positions.size(), expected.positions.size());
    std::map<std::uint32_t, std::size_t> places;
    for (std::size_t i = 0; i < expected.positions.size(); ++i) places[place_of(expected.positions[i])] = i;
    const float step = bits == 0 ? 0 : 1 / float((1 << bits) - 1), rounding = bits == 0 ? 0 : 1e-5f;
    for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
        const std::size_t j = places.at(place_of(mesh.positions[i]));
        const auto near = [&](auto a, auto b, float half) {
            for (int c = 0; c < a.length(); ++c) EXPECT_NEAR(a[c], b[c], half + rounding) << i;
        };
        near(mesh.positions[i], expected.positions[j], kSide * step / 2);
        near(mesh.normals[i], expected.normals[j], 4 * step);  // two octahedral coordinates from -1 to 1
        near(mesh.uvs[0][i], expected.uvs[0][j], step / 2);
        EXPECT_EQ(mesh.colors[i], expected.colors[j]) << i;
    }
}

enum GridAccessor { kPosition, kNormal, kUv, kIndices, kColors };

GltfBuilder grid(const DracoEncoding* encoding) {
    GltfBuilder b;
    Json& primitive = add_grid(b, kSide);
    std::vector<std::uint8_t> colors;
    for (int i = 0; i < (kSide + 1) * (kSide + 1); ++i)
        for (const int c : {i % 256, 7, 255 - i % 100, 255}) colors.push_back(static_cast<std::uint8_t>(c));
    primitive["attributes"]["COLOR_0"] = b.accessor("VEC4", kU8, colors, true);
    if (encoding) compress_by_draco(b, primitive, *encoding);
    return b;
}

Json& extension(GltfBuilder& b) {
    return b.primitive()["extensions"]["KHR_draco_mesh_compression"];
}

/// Returns the range of the compressed data in the bytes of b.glb().
std::pair<std::size_t, std::size_t> data_range(GltfBuilder& b, const std::string& glb) {
    const Json& view = b.json["bufferViews"][extension(b)["bufferView"].get<int>()];
    return {glb.size() - (b.bytes().size() + 3) / 4 * 4 + view["byteOffset"].get<std::size_t>(), view["byteLength"]};
}

/// Returns the greatest resident memory of this process so far.
std::size_t peak_bytes() {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return std::size_t{1024} * static_cast<std::size_t>(usage.ru_maxrss);
}

TEST_F(GltfDraco, EveryEncodingGivesTheGeometry) {
    const Scene plain = load(grid(nullptr));
    const SceneSize expected = open(grid(nullptr)).size();
    for (const bool edgebreaker : {true, false})
        for (const int speed : {0, 3, 5, 7, 10})
            for (const int bits : {0, 8, 14, 20}) {
                SCOPED_TRACE(fmt::format("edgebreaker {} speed {} bits {}", edgebreaker, speed, bits));
                const DracoEncoding encoding{edgebreaker, speed, bits, speed == 3};
                GltfScene file = open(grid(&encoding));
                const SceneSize size = file.size();
                EXPECT_EQ(size.geometry_bytes, expected.geometry_bytes);
                EXPECT_EQ(size.drawn, expected.drawn);
                EXPECT_GT(size.decoding_bytes, expected.decoding_bytes);
                const Scene scene = file.at_rest();
                EXPECT_TRUE(scene.report.warnings.empty());
                expect_same(scene.meshes.at(0), plain.meshes.at(0), bits);
                if (!edgebreaker) {
                    EXPECT_EQ(scene.meshes[0].triangles, plain.meshes[0].triangles);
                }
            }
}

/// Every triangle of the grid has vertices and texture coordinates of its own.
TEST_F(GltfDraco, VerticesSplitAtSeams) {
    const Mesh plain = load(grid(nullptr)).meshes.at(0);
    GltfBuilder b;
    std::vector<float> positions, uvs;
    std::vector<std::uint16_t> corners;
    for (const uvec3& t : plain.triangles)
        for (int i = 0; i < 3; ++i) {
            const vec3& p = plain.positions[t[i]];
            positions.insert(positions.end(), {p.x, p.y, p.z});
            uvs.insert(uvs.end(), {static_cast<float>(corners.size() / 3), static_cast<float>(i)});
            corners.push_back(static_cast<std::uint16_t>(corners.size()));
        }
    Json& primitive = b.add_mesh({{"POSITION", b.floats("VEC3", positions)}, {"TEXCOORD_0", b.floats("VEC2", uvs)}});
    primitive["indices"] = b.accessor("SCALAR", kU16, corners);
    for (const bool edgebreaker : {true, false}) {
        GltfBuilder split = b;
        compress_by_draco(split, split.primitive(), {.edgebreaker = edgebreaker, .bits = 0, .share = true});
        const Mesh mesh = load(split).meshes.at(0);
        ASSERT_EQ(mesh.positions.size(), corners.size());
        EXPECT_EQ(triangles_by_place(mesh), triangles_by_place(plain));
        for (std::size_t i = 0; i < mesh.uvs[0].size(); ++i) {
            const vec2 uv = mesh.uvs[0][i];
            const uvec3& t = plain.triangles.at(static_cast<std::size_t>(uv.x));
            EXPECT_EQ(mesh.positions[i], plain.positions[t[static_cast<int>(uv.y)]]);
        }
        // Edgebreaker's header has the number before the split.
        for (const char* name : {"POSITION", "TEXCOORD_0"})
            split.json["accessors"][split.primitive()["attributes"][name].get<int>()]["count"] = 800;
        EXPECT_EQ(load(split).meshes.at(0).positions, mesh.positions);
    }
}

/// Two triangles of a strip, a morph target beside the compressed data, joints, and an attribute that is not
/// compressed.
TEST_F(GltfDraco, PartsBesideTheCompressedData) {
    const DracoEncoding in_order{false, 5, 0, false};
    GltfBuilder b;
    Json& primitive = add_grid(b, kSide);
    constexpr int kVertices = (kSide + 1) * (kSide + 1);
    std::vector<std::uint16_t> joints(4 * kVertices);
    std::vector<float> weights(4 * kVertices), lift(3 * kVertices), uvs(2 * kVertices, 0.25f);
    for (std::size_t i = 0; i < kVertices; ++i) {
        joints[4 * i] = i % 2;
        weights[4 * i] = 1;
        lift[3 * i + 2] = static_cast<float>(i);
    }
    primitive["attributes"]["JOINTS_0"] = b.accessor("VEC4", kU16, joints);
    primitive["attributes"]["WEIGHTS_0"] = b.floats("VEC4", weights);
    b.json["nodes"][0]["skin"] = b.push("skins", {{"joints", {1, 2}}});
    b.push("nodes", Json::object());
    b.push("nodes", {{"translation", {0, 100, 0}}});
    primitive["targets"] = {{{"POSITION", b.floats("VEC3", lift)}}};
    b.json["meshes"][0]["weights"] = {0.5};
    GltfBuilder whole = b;
    compress_by_draco(b, primitive, in_order);
    const int beside = b.floats("VEC2", uvs);
    for (GltfBuilder* builder : {&b, &whole})
        builder->primitive()["attributes"]["TEXCOORD_1"] = builder == &b ? beside : builder->floats("VEC2", uvs);
    const Mesh mesh = load(b).meshes.at(0), expected = load(whole).meshes.at(0);
    EXPECT_EQ(mesh.positions, expected.positions);
    EXPECT_EQ(mesh.triangles, expected.triangles);
    EXPECT_EQ(mesh.uvs, expected.uvs);
    EXPECT_EQ(mesh.positions[1], vec3(1, 100, std::sin(1.0f) + 0.5f));

    // A strip has as many triangles as its indices allow, or fewer where it joins parts by degenerate triangles.
    b = whole;
    compress_by_draco(b, b.primitive(), in_order);
    b.primitive()["mode"] = 5;
    b.json["accessors"][b.primitive()["indices"].get<int>()]["count"] = 2 * kSide * kSide + 2;
    EXPECT_EQ(load(b).meshes.at(0).triangles, expected.triangles);
    expect_refused(b, {{"/meshes/0/primitives/0/mode", 6, "meshes[0].primitives[0]"}});
}

TEST_F(GltfDraco, CompressedDataReplacesItsFallback) {
    const DracoEncoding in_order{false, 5, 0, false};
    GltfBuilder b = grid(&in_order);
    const Mesh expected = load(b).meshes.at(0);
    b.json["accessors"][kPosition]["bufferView"] = b.view(std::vector<float>(3 * expected.positions.size(), 7));
    b.json.erase("extensionsRequired");
    EXPECT_EQ(load(b).meshes.at(0).positions, expected.positions);
    // Integers of the accessor's type are converted from the type of the data.
    b.json["accessors"][kColors].update({{"componentType", kU16}, {"normalized", false}});
    EXPECT_EQ(load(b).meshes.at(0).positions, expected.positions);
}

TEST_F(GltfDraco, CountsAndAttributesMustMatch) {
    const DracoEncoding encoding;
    GltfBuilder b = grid(&encoding);
    const auto accessor = [](GridAccessor a, const char* key) { return fmt::format("/accessors/{}/{}", int(a), key); };
    const std::string object = "/meshes/0/primitives/0/extensions/KHR_draco_mesh_compression/";
    const std::string element = "meshes[0].primitives[0]";
    expect_refused(b, {{accessor(kNormal, "type"), "VEC2", element},
                       {accessor(kPosition, "componentType"), kU8, element},
                       {object + "attributes/POSITION", 1000, element},
                       {object + "attributes/NORMAL", "a", element},
                       {object + "bufferView", 99, element},
                       {object + "bufferView", 0, element}});
    // Fewer elements than the accessors say are usable.
    for (Json& a : b.json["accessors"]) a["count"] = 200;
    b.json["accessors"][kIndices]["count"] = 1000;
    const Scene scene = load(b);
    EXPECT_EQ(scene.meshes.at(0).positions.size(), 169u);
    EXPECT_EQ(scene.report.warnings.size(), 1u);
}

TEST_F(GltfDraco, BombsAreRefusedFromTheHeader) {
    const DracoEncoding encoding;
    GltfBuilder b = grid(&encoding);
    for (Json& accessor : b.json["accessors"]) accessor["count"] = 3u << 28;
    const std::string glb = b.glb();
    const std::size_t begin = data_range(b, glb).first;
    const struct {
        std::size_t offset;
        std::string bytes;
        const char* reason;
    } cases[] = {
        // After 11 bytes of header: the traversal, vertices and triangles as numbers of 7 bits per byte.
        {12, "\xff\xff\xff\x7f\xff\xff\xff\x7f", "cannot have 268435455 triangles"},
        {5, "\x01", "version 1.2"},
        {5, "\x03", "version 3.2"},
        {7, std::string(1, '\0'), "no triangle mesh"},
        {8, "\x02", "no triangle mesh"},
        // Metadata: flag, attributes, entries, and 2^32 - 1 children.
        {10, std::string("\x80\0\0\xff\xff\xff\xff\x0f", 8), "damaged header"},
    };
    for (const auto& [offset, bytes, reason] : cases) {
        std::string damaged = glb;
        damaged.replace(begin + offset, bytes.size(), bytes);
        const std::string message = error_message([&] { GltfScene(write("scene.glb", damaged)).size(); });
        EXPECT_NE(message.find(reason), std::string::npos) << message;
    }
}

TEST_F(GltfDraco, DataBeyondTheBudgetIsRefused) {
    const DracoEncoding encoding;
    const fs::path path = write("scene.glb", grid(&encoding).glb());
    for (const std::size_t left : {100, 10000, 110000}) {
        const std::string message = without_name(refusal_with_memory(path, left));
        EXPECT_TRUE(message.starts_with("meshes[0].primitives[0]: needs")) << left << ": " << message;
    }
    // Attributes that the primitive does not use stand behind the connectivity.
    const DracoEncoding unused{.edgebreaker = false, .unused = 100};
    const fs::path large = write("large.glb", grid(&unused).glb());
    EXPECT_EQ(load_gltf(large).meshes.at(0).positions.size(), 169u);
    const std::size_t connectivity = GltfScene(large).size().decoding_bytes;
    const std::string message = without_name(refusal_with_memory(large, connectivity + 700000));
    EXPECT_NE(message.find("(Draco attributes)"), std::string::npos) << message;
}

/// tests/fuzz/test_regressions.cpp changes bytes of such data.
TEST_F(GltfDraco, EveryTruncationIsRefused) {
    for (const DracoEncoding& encoding :
         {DracoEncoding{true, 0, 14, true}, DracoEncoding{true, 5, 14, false}, DracoEncoding{true, 10, 0, false},
          DracoEncoding{false, 5, 14, false}, DracoEncoding{false, 10, 11, false}}) {
        GltfBuilder b = grid(&encoding);
        Json& view = b.json["bufferViews"][extension(b)["bufferView"].get<int>()];
        const std::size_t size = view["byteLength"];
        for (std::size_t length = 0; length < size; length += 1 + length / 16) {
            view["byteLength"] = length;
            EXPECT_TRUE(refusal(b).starts_with("meshes[0].primitives[0]: ")) << length << " bytes";
        }
    }
}

/// The library decodes up to 2^31 orientations of texture coordinates, which take seconds and 256 MiB per attribute.
/// The number stands behind compressed data, so this test puts it everywhere.
TEST_F(GltfDraco, HugeNumbersAnywhereTakeNoMemory) {
    GltfBuilder b;
    Json& primitive = add_grid(b, 4);
    primitive["attributes"].erase("NORMAL");
    compress_by_draco(b, primitive, {.speed = 0, .bits = 10});
    const std::string glb = b.glb();
    const auto [begin, size] = data_range(b, glb);
    bool orientations = false;
    const std::size_t before = peak_bytes();
    for (std::size_t i = 0; i + 4 <= size; ++i) {
        std::string damaged = glb;
        damaged.replace(begin + i, 4, "\xff\xff\xff\x7f");
        orientations |= refusal_of_bytes(damaged).find("texture coordinates") != std::string::npos;
    }
    EXPECT_TRUE(orientations) << "the number was not found";
#ifndef HALFLIGHT_SANITIZED
    EXPECT_LT(peak_bytes() - before, std::size_t{128} << 20);
#endif
}

/// Returns a triangle whose Draco data is a header and a table of `bytes` bytes, for 64 times as many symbols. No
/// symbol occurs, so the library refuses the table once it is in memory.
GltfBuilder table_of_symbols(std::size_t bytes) {
    // Sequential encoding of one triangle of three vertices, whose indices are compressed by symbols of one bit.
    std::string data("DRACO\2\2\1\0\0\0\1\3\0\1\1", 16);
    std::size_t symbols = 64 * bytes;
    for (; symbols >= 128; symbols /= 128) data += static_cast<char>(symbols % 128 + 128);
    data += static_cast<char>(symbols);
    data.append(bytes, '\xff');  // 64 symbols without occurrence
    GltfBuilder b;
    const int view = b.view(std::vector<char>(data.begin(), data.end()));
    b.add_triangle()["extensions"]["KHR_draco_mesh_compression"] = {{"bufferView", view},
                                                                    {"attributes", {{"POSITION", 0}}}};
    return b;
}

TEST_F(GltfDraco, TablesOfSymbolsAreCounted) {
    constexpr std::size_t kTable = 100000, kMemory = 64 * 12 * kTable;
    const fs::path path = write("scene.glb", table_of_symbols(kTable).glb());
    EXPECT_GE(GltfScene(path).size().decoding_bytes, kMemory);
    const std::string message = without_name(refusal_with_memory(path, kMemory));
    EXPECT_TRUE(message.starts_with("meshes[0].primitives[0]: needs")) << message;
    const std::string damage = without_name(refusal_with_memory(path, kMemory + 100 * kTable));
    EXPECT_NE(damage.find("its Draco data is damaged"), std::string::npos) << damage;
    const std::string longer = refusal(table_of_symbols(std::size_t{1} << 21));
    EXPECT_NE(longer.find("bytes, too many for 1 triangles and 3 vertices"), std::string::npos) << longer;
}

/// A scene keeps what its poses read: no texture coordinates and colours, and no tangents without a normal map.
TEST_F(GltfDraco, KeptPrimitivesAreInTheLedger) {
    const DracoEncoding encoding;
    const GltfDocument document = open_gltf(write("scene.glb", grid(&encoding).glb()), {});
    const tinygltf::Primitive& primitive = document.model.meshes[0].primitives[0];
    const auto held = [before = MemoryLedger::process().bytes(MemoryPart::scene)] {
        return MemoryLedger::process().bytes(MemoryPart::scene) - before;
    };
    {
        const auto all = decode_draco(document, primitive, "primitive");
        EXPECT_EQ(held(), 169 * (12 + 12 + 8 + 4u));
    }
    const GltfPrimitive kept(document, primitive, "primitive", nullptr, 0, false);
    EXPECT_EQ(held(), 169 * (12 + 12u));
    EXPECT_EQ(kept.read().normals.size(), 169u);
}

TEST_F(GltfDraco, FilesOfOthers) {
    const fs::path folder = fs::path(HALFLIGHT_SHARED_DIR) / "extensions/compressed";
    if (!fs::exists(folder)) GTEST_SKIP() << "no files in " << folder;
    const auto corners = [&](const char* file) {
        const Scene scene = load_gltf(folder / file);
        std::vector<std::array<float, 6>> values;
        for (const Instance& instance : scene.instances) {
            const Mesh& mesh = scene.meshes[static_cast<std::size_t>(instance.mesh)];
            for (const uvec3& t : mesh.triangles)
                for (int i = 0; i < 3; ++i) {
                    const vec3 p(instance.object_to_world * dvec4(mesh.positions[t[i]], 1));
                    const vec3 n(glm::normalize(dmat3(instance.object_to_world) * dvec3(mesh.normals[t[i]])));
                    values.push_back({p.x, p.y, p.z, n.x, n.y, n.z});
                    for (float& x : values.back()) x = std::round(x * 1000) / 1000 + 0.0f;
                }
        }
        std::ranges::sort(values);
        return values;
    };
    const auto draco = corners("BoxDraco.gltf");
    EXPECT_EQ(draco.size(), 36u);
    EXPECT_EQ(draco, corners("BoxMeshopt.gltf"));
    EXPECT_EQ(draco, corners("BoxMeshopt.glb"));
    EXPECT_EQ(load_gltf(folder / "DracoSparseMesh.gltf").meshes.at(0).triangles.size(), 102u);
    EXPECT_GT(load_gltf(folder / "heart_draco.glb").meshes.at(0).triangles.size(), 100u);
}

}  // namespace
}  // namespace halflight
