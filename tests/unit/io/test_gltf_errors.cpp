// Tests that invalid glTF files are refused by a message that names the element, without reads out of bounds.
#include <algorithm>

#include "tests/unit/io/gltf_builder.h"

namespace halflight {
namespace {

namespace fs = std::filesystem;

using GltfIndices = GltfTest;
using GltfFiles = GltfTest;
using GltfContainer = GltfTest;
using GltfText = GltfTest;

/// Returns a scene with one of each kind of index.
GltfBuilder everything() {
    GltfBuilder b;
    Json& primitive = b.add_triangle();
    primitive["indices"] = b.accessor("SCALAR", kU8, std::vector<std::uint8_t>{0, 1, 2});
    primitive["material"] = b.push("materials", {{"emissiveTexture", {{"index", 0}}}});
    primitive["attributes"]["JOINTS_0"] = b.accessor("VEC4", kU8, std::vector<std::uint8_t>(12, 0));
    primitive["attributes"]["WEIGHTS_0"] = b.floats("VEC4", {1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0});
    primitive["targets"] = {{{"POSITION", 0}}};
    b.push("textures", {{"source", 0}, {"sampler", 0}});
    b.push("samplers", Json::object());
    b.push("images", {{"uri", "a.png"}});
    b.push("skins",
           {{"joints", {0}}, {"inverseBindMatrices", b.floats("MAT4", std::vector<float>(16, 0))}, {"skeleton", 0}});
    b.push("cameras", {{"type", "perspective"}, {"perspective", {{"yfov", 1}, {"znear", 1}}}});
    b.json["nodes"][0].update({{"skin", 0}, {"camera", 0}});
    b.push("scenes", {{"nodes", {0}}});
    b.json["scene"] = 0;
    return b;
}

/// Converts a JSON pointer to its name in messages: "/nodes/0/mesh" is nodes[0].mesh.
std::string subject_of(std::string_view pointer) {
    std::string subject;
    for (pointer.remove_prefix(1); !pointer.empty();) {
        const std::string_view step = pointer.substr(0, pointer.find('/'));
        pointer.remove_prefix(std::min(pointer.size(), step.size() + 1));
        subject += step == "0" ? "[0]" : fmt::format("{}{}", subject.empty() ? "" : ".", step);
    }
    return subject;
}

TEST_F(GltfIndices, OutOfRangeAreNamedWhereverTheyAre) {
    const struct {
        const char* pointer;
        const char* list;
    } cases[] = {
        {"/accessors/0/bufferView", "bufferViews"},
        {"/bufferViews/0/buffer", "buffers"},
        {"/images/0/bufferView", "bufferViews"},
        {"/materials/0/emissiveTexture/index", "textures"},
        {"/meshes/0/primitives/0/attributes/POSITION", "accessors"},
        {"/meshes/0/primitives/0/indices", "accessors"},
        {"/meshes/0/primitives/0/material", "materials"},
        {"/meshes/0/primitives/0/targets/0/POSITION", "accessors"},
        {"/nodes/0/camera", "cameras"},
        {"/nodes/0/mesh", "meshes"},
        {"/nodes/0/skin", "skins"},
        {"/nodes/0/children/0", "nodes"},
        {"/scene", "scenes"},
        {"/scenes/0/nodes/0", "nodes"},
        {"/skins/0/inverseBindMatrices", "accessors"},
        {"/skins/0/joints/0", "nodes"},
        {"/skins/0/skeleton", "nodes"},
        {"/textures/0/sampler", "samplers"},
        {"/textures/0/source", "images"},
    };
    const std::set<std::string> required{"/bufferViews/0/buffer", "/materials/0/emissiveTexture/index",
                                         "/meshes/0/primitives/0/attributes/POSITION",
                                         "/meshes/0/primitives/0/targets/0/POSITION"};
    for (const auto& [pointer, list] : cases) {
        for (const Json& wrong : {Json(99), Json(-1), Json(1.5), Json("0"), Json(4294967296u), Json(nullptr)}) {
            GltfBuilder b = everything();
            b.add_buffer();
            const Json::json_pointer place(pointer);
            const bool optional = b.json[place.parent_pointer()].is_object() && !required.contains(pointer);
            if (wrong.is_null() && optional) continue;  // is ignored
            b.json[place] = wrong;
            const std::string message = refusal(b);
            EXPECT_TRUE(message.starts_with(subject_of(pointer) + ": ")) << pointer << " " << wrong << ": " << message;
            if (wrong == Json(99)) {
                EXPECT_NE(message.find(fmt::format("99 is not an index into {}", list)), std::string::npos);
            }
        }
    }
}

TEST_F(GltfIndices, AccessorsMustLieWithinTheirBuffers) {
    GltfBuilder b = everything();
    b.json["nodes"][0].erase("skin");
    b.json["materials"][0] = Json::object();
    b.add_buffer();
    b.push("accessors", {{"componentType", 1}, {"count", 1}, {"type", "VEC3"}});  // nothing uses it
    EXPECT_EQ(refusal(b), "");
    expect_refused(b, {{"/accessors/0/count", 4, "accessors[0]: ends at byte 48 of bufferViews[0], which has 36"},
                       {"/accessors/0/byteOffset", 4, "accessors[0]: "},
                       {"/accessors/0/count", 1ull << 53, "accessors[0]: "},
                       {"/accessors/0/count", (1ull << 53) + 1, "accessors[0].count: "},
                       {"/accessors/0/byteOffset", UINT64_MAX, "accessors[0].byteOffset: "},
                       {"/bufferViews/0/byteLength", 1u << 30, "bufferViews[0]: ends at byte 1073741824 of"},
                       {"/bufferViews/0/byteOffset", 1ull << 52, "bufferViews[0]: ends at byte"},
                       {"/bufferViews/0/byteStride", 8, "accessors[0]: "},
                       {"/accessors/0/type", "VEC2", "accessors[0]: "},
                       {"/accessors/0/componentType", 5124, "accessors[0]: componentType 5124"},
                       {"/accessors/0/componentType", 1, "accessors[0]: componentType 1 "},
                       {"/accessors/0/componentType", 5130, "accessors[0]: componentType 5130"},
                       {"/accessors/1/componentType", kI8, "accessors[1]: componentType 5120"},
                       {"/meshes/0/primitives/0/mode", 7, "meshes[0].primitives[0]: "},
                       {"/meshes/0/primitives/0/attributes/NORMAL", 1, "accessors[1]: "},
                       {"/buffers/0/byteLength", 1u << 20, "buffers[0]: "},
                       {"/accessors/0/sparse", {{"count", 3}}, "accessors[0].sparse: "}});
}

TEST_F(GltfIndices, VerticesMustExist) {
    GltfBuilder b;
    b.add_triangle();
    const int indices = b.accessor("SCALAR", kU32, std::vector<std::uint32_t>{0, 1, 2, 2, 3, 1});
    const int colors = b.floats("VEC3", {0, 0, 0, 1, 1, 1}), offsets = b.floats("VEC3", {0, 0, 0});
    b.json["meshes"][0]["weights"] = {1};
    expect_refused(b, {{"/meshes/0/primitives/0/indices", indices, "meshes[0].primitives[0]: index 3 at place 4"},
                       {"/meshes/0/primitives/0/attributes/COLOR_0", colors, "meshes[0].primitives[0]: COLOR_0"},
                       {"/meshes/0/primitives/0/targets",
                        {{{"POSITION", offsets}}},
                        "meshes[0].primitives[0]: POSITION has 1 elements"}});
}

TEST_F(GltfIndices, SparseOnesAreCheckedToo) {
    GltfBuilder b;
    b.add_triangle();
    b.make_sparse(0, {2, 3}, {0, 1, 0});
    b.json["accessors"][0]["sparse"]["count"] = 1;
    EXPECT_EQ(refusal(b), "");
    const std::string sparse = "/accessors/0/sparse";
    expect_refused(b, {{sparse + "/count", 3, "accessors[0].sparse.indices: ends at byte 3"},
                       {sparse + "/count", 2, "accessors[0].sparse.values: ends at byte 24"},
                       {sparse + "/indices/byteOffset", 1, "accessors[0]: sparse index 3"},
                       {sparse + "/indices/byteOffset", 4294967296u, "accessors[0].sparse.indices.byteOffset: "},
                       {sparse + "/values/bufferView", 1, "accessors[0].sparse.values: ends at byte 12"},
                       {sparse + "/values/bufferView", 9, "accessors[0].sparse.values.bufferView: "},
                       {sparse + "/indices/componentType", kI8, "accessors[0]: "}});
}

TEST_F(GltfIndices, AccessorsWithoutBufferAreLimited) {
    GltfBuilder b;
    b.add_triangle();
    b.json["accessors"][0].erase("bufferView");
    expect_refused(b, {{"/accessors/0/count", 1ull << 40, "meshes[0].primitives[0]: 1099511627776 vertices"}});
    b.primitive()["indices"] = b.accessor("SCALAR", kU8, std::vector<std::uint8_t>{0, 1, 2});
    expect_refused(b, {{"/accessors/0/count", 1u << 31, "accessors[0]: 2147483648 elements"}});
}

TEST_F(GltfIndices, NodesMustMakeATree) {
    const std::pair<Json, std::string> cases[] = {
        {{{{"children", {1}}}, {{"children", {2}}}, {{"children", {0}}}, Json::object()}, "nodes[0]: "},
        {{{{"children", {0}}}}, "nodes[0]: "},
        {{{{"children", {2}}}, {{"children", {2}}}, Json::object()},
         "nodes[2]: is a child of both nodes[0] and nodes[1]"},
        {{{{"scale", {1e300, 1, 1}}, {"children", {1}}}, {{"scale", {1e300, 1, 1}}}}, "nodes[0]: "},
    };
    for (const auto& [nodes, element] : cases) {
        GltfBuilder b;
        b.json["nodes"] = nodes;
        EXPECT_TRUE(refusal(b).starts_with(element)) << nodes << refusal(b);
    }
}

TEST_F(GltfText, FilesOfOtherProgramsAreNamed) {
    using namespace std::literals;
    const std::pair<std::string, const char*> cases[] = {
        {"BLENDER-v300RENDH", "is a Blender file"},
        {"Kaydara FBX Binary  \0\x1a\0"s, "is an FBX file"},
        {"# Blender 4.0\n\nmtllib a.mtl\no Cube\n", "is a Wavefront OBJ file"},
        {std::string(80, ' ') + "\1\0\0\0"s + std::string(50, '\0'), "is an STL file"},
        {"RIFF\0\0\0\0WEBP"s, "is a WebP picture"},
        {"\x89HLP\r\n\x1a\n", "is a page file of Halflight"},
        {R"({"parts": []})", "is a list of files"},
    };
    for (const auto& [text, kind] : cases)
        EXPECT_TRUE(refusal_of_text(text).starts_with(kind)) << refusal_of_text(text);
}

TEST_F(GltfText, OtherFormatsAreRefused) {
    const std::string asset = R"({"asset": {"version": "2.0"})";
    EXPECT_EQ(refusal_of_text(asset + "}"), "");
    EXPECT_EQ(refusal_of_text("\xef\xbb\xbf" + asset + "}"), "") << "a byte order mark";
    const std::pair<std::string, const char*> cases[] = {
        {"", "is empty"},
        {"solid cube", "is an STL file"},
        {"a cube", "is neither GLB nor glTF's JSON"},
        {"{}", "has no 'asset'"},
        {asset, "parse error at line 1"},
        {R"({"asset": {"version": "1.0"}})", "is glTF 1.0"},
        {R"({"asset": {"version": 1.0}, "scenes": {"main": {}}})", "is glTF 1.0"},
        {R"({"nodes": {"root": {}}})", "is glTF 1.0"},
        {R"({"asset": {"version": "2.1", "minVersion": "2.1"}})", "is glTF 2.1"},
        {asset + R"(, "nodes": {}})", "nodes: "},
        {asset + R"(, "nodes": [1]})", "nodes[0]: "},
        {asset + R"(, "nodes": [{"scale": [1, 2]}]})", "nodes[0].scale: "},
        {asset + R"(, "nodes": [{"scale": [1, 2, "3"]}]})", "nodes[0].scale[2]: "},
        {asset + R"(, "nodes": [{"scale": [1, 2, 1e999]}]})", ""},
        {asset + R"(, "materials": [{"pbrMetallicRoughness": {"metallicFactor": true}}]})",
         "materials[0].pbrMetallicRoughness.metallicFactor: "},
        {asset + R"(, "materials": [{"extensions": {"KHR_materials_ior": 3}}]})",
         "materials[0].extensions.KHR_materials_ior: "},
        {R"({"asset": {"version": "2.0"}, "extensionsRequired": ["KHR_lights_punctual", "X_c", "X_a"]})",
         "requires what is not supported: X_c, X_a"},
        {asset + R"(, "extras": )" + std::string(1000, '['), "JSON is nested deeper than 256 levels"},
        {asset + R"(, "extras": )" + std::string(1000000, '['), "JSON is nested deeper than 256 levels"},
    };
    for (const auto& [text, start] : cases) {
        const std::string message = refusal_of_text(text);
        EXPECT_TRUE(!message.empty() && message.starts_with(start)) << text.substr(0, 200) << ": " << message;
    }
}

TEST_F(GltfText, RequiredExtensionsWithoutEffectGiveAWarning) {
    for (const std::string name :
         {"KHR_xmp_json_ld", "KHR_interactivity", "KHR_node_hoverability", "KHR_node_selectability"}) {
        const std::string names = "[\"" + name + "\"]";
        const Scene scene = load_text(R"({"asset": {"version": "2.0", "extensions": {")" + name + R"(": {"packet": 0}}},
            "extensions": {")" + name +
                                      R"(": {"graphs": [], "packets": [{}]}}, "nodes": [{"extensions": {")" + name +
                                      R"(": {"selectable": true}}}], "extensionsUsed": )" + names +
                                      R"(, "extensionsRequired": )" + names + "}");
        expect_warnings(scene.report.warnings, {"extension " + name + " is ignored: "});
    }
}

TEST_F(GltfText, UnknownUsedExtensionsGiveAWarning) {
    const Scene scene =
        load_text(R"({"asset": {"version": "2.0"}, "extensionsUsed": ["X_b", "KHR_materials_ior", "X_b"]})");
    expect_warnings(scene.report.warnings, {"extension X_b is used but not supported"});
}

/// Returns the JSON of a triangle with a buffer at `uri`.
std::string with_buffer(const std::string& uri, std::uint64_t length = 36) {
    GltfBuilder b;
    b.add_triangle();
    b.json["buffers"] = {{{"uri", uri}, {"byteLength", length}}};
    return b.json.dump();
}

std::string triangle_bytes() {
    GltfBuilder b;
    b.add_triangle();
    return b.bytes();
}

TEST_F(GltfFiles, BuffersBesideTheScene) {
    fs::create_directory(folder_ / "sub");
    write("sub/b+ü.bin", triangle_bytes() + "more than is needed");
    for (const char* uri : {"sub/b+ü.bin", "sub/b+%C3%bc.bin", "./sub/../sub/b%2B%c3%BC.bin",
                            "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"})
        EXPECT_EQ(load_text(with_buffer(uri)).meshes.at(0).positions[2], vec3(0, 1, 0)) << uri;
    write("b.bin", triangle_bytes()), write("c?d#e%41.bin", triangle_bytes());
    for (const char* uri : {"b.bin?version=2", "b.bin#part", "%62.bin?a#b", "c?d#e%41.bin", "c?d#e%2541.bin"})
        EXPECT_EQ(load_text(with_buffer(uri)).meshes.at(0).positions[2], vec3(0, 1, 0)) << uri;
    const std::string pointer = "version https://git-lfs.github.com/spec/v1\noid sha256:0123\nsize 36\n";
    write("lfs.bin", pointer);
    EXPECT_NE(refusal_of_text(pointer).find("Git LFS pointer"), std::string::npos);
    const struct {
        const char* uri;
        std::uint64_t length;
        const char* message;
    } cases[] = {{"sub/b+ü.bin", 100, "buffers[0]: 55 bytes, but byteLength is 100"},
                 {"sub", 36, "buffers[0]: "},
                 {"none.bin", 36, "buffers[0]: "},
                 {"a%00b", 36, "buffers[0]: "},
                 {"lfs.bin", 36, "buffers[0]: 'lfs.bin' is a Git LFS pointer"},
                 {"data:;base64,AAA*", 36, "buffers[0]: its data URI is malformed"},
                 {"data:;base64,AAAAA", 36, "buffers[0]: its data URI is malformed"},
                 {"data:;base64", 36, "buffers[0]: its data URI is malformed"},
                 {"data:;base64,AA=A", 36, "buffers[0]: its data URI is malformed"},
                 {"data:;base64,AAA%3D%3D%3D", 36, "buffers[0]: its data URI is malformed"},
                 {"data:base64,AAAA", 36, "buffers[0]: 4 bytes, but byteLength is 36"},
                 {"data:;base64,AAAA", 36, "buffers[0]: 3 bytes, but byteLength is 36"}};
    for (const auto& [uri, length, message] : cases)
        EXPECT_TRUE(refusal_of_text(with_buffer(uri, length)).starts_with(message)) << uri;
    for (const fs::path& scene : {folder_ / "none.glb", folder_.path})
        EXPECT_NE(error_message([&] { load_gltf(scene); }).find(scene.string() + ": cannot read"), std::string::npos);
}

/// RFC 2397, and the lenient base64 of browsers.
TEST_F(GltfFiles, DataUrisOfAllSpellings) {
    const std::string base64 = "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA";
    std::string escaped, bytes, spaced;
    for (const char c : base64) escaped += fmt::format("%{:02X}", c), spaced += {' ', c};
    for (const char c : triangle_bytes()) bytes += fmt::format("%{:02x}", static_cast<unsigned char>(c));
    for (const std::string& uri :
         {"data:;BASE64," + base64, "DATA:Application/GLTF-Buffer;charset=utf-8;Base64," + base64,
          " data:;base64 ," + base64, "data:text/plain; base64," + base64, "data:;base64,\n" + spaced + "\n",
          "data:;base64," + escaped, "data:;base64," + base64 + "AA%3D%3d", "data:;base64," + base64 + "AA=#f=1",
          "data:;base64," + base64 + "AA", "data:," + bytes, "data:text/plain;charset=base64," + bytes + "#f",
          "data:application/octet-stream;x=;base64," + base64})
        EXPECT_EQ(load_text(with_buffer(uri)).meshes.at(0).positions[2], vec3(0, 1, 0)) << uri;
}

TEST_F(GltfFiles, NothingOutsideTheFolderIsRead) {
    fs::create_directory(folder_ / "inner");
    write("secret.bin", triangle_bytes());
    fs::create_symlink("../secret.bin", folder_ / "inner/link.bin");
    const auto read = [&](const std::string& uri, bool trusting) {
        const fs::path scene = write("inner/scene.gltf", with_buffer(uri));
        return without_name(error_message([&] { load_gltf(scene, {.allow_outside_folder = trusting}); }));
    };
    const std::string absolute = (folder_ / "secret.bin").string();
    for (const std::string& uri : std::vector<std::string>{"../secret.bin", "%2e%2e/secret.bin", "x/../../secret.bin",
                                                           absolute, "link.bin", "../secret.bin?x"}) {
        EXPECT_TRUE(read(uri, false).starts_with("buffers[0]: ")) << uri;
        // No folder x exists, so the system cannot resolve a path through it.
        EXPECT_EQ(read(uri, true).empty(), uri[0] != 'x') << uri;
    }
    for (const char* uri : {"http://host/a.bin", "file:///etc/passwd", "C:/a.bin"})
        EXPECT_NE(read(uri, true).find("cannot follow a URI"), std::string::npos);
}

TEST_F(GltfFiles, JsonIsLimited) {
    write("a.bin", triangle_bytes());
    const fs::path scene = write("scene.gltf", with_buffer("a.bin"));
    GltfOptions options;
    options.max_json_bytes = fs::file_size(scene) - 1;
    EXPECT_NE(error_message([&] { load_gltf(scene, options); }).find("more than the limit of"), std::string::npos);
    ++options.max_json_bytes;
    EXPECT_NO_THROW(load_gltf(scene, options));
}

/// A file of which little is used may have any size: its holes take no room on the disk, and are not read.
TEST_F(GltfFiles, BuffersAreReadInParts) {
    const fs::path bin = write("a.bin", triangle_bytes());
    const std::uint64_t size = std::uint64_t{1} << 40;
    std::error_code none;
    fs::resize_file(bin, size, none);
    if (none) GTEST_SKIP() << "the file system has no files of " << size << " bytes";
    for (const std::uint64_t length : {size, std::uint64_t{36}}) {
        GltfScene opened(write("scene.gltf", with_buffer("a.bin", length)));
        EXPECT_EQ(opened.at_rest().meshes.at(0).triangles.size(), 1u) << length;
        fs::resize_file(bin, size - 1);
        EXPECT_NE(error_message([&] { opened.at_rest(); }).find("a.bin: cannot read: was changed while it was read"),
                  std::string::npos);
        fs::resize_file(bin, size);
    }
}

TEST_F(GltfContainer, DamageAnywhereIsRefused) {
    GltfBuilder b;
    b.add_triangle();
    const std::string glb = b.glb();
    for (std::size_t length = 0; length < glb.size(); ++length)
        EXPECT_NE(refusal_of_bytes(glb.substr(0, length)), "") << length;
    const struct {
        std::size_t offset;
        std::uint32_t value;
        const char* start;
    } cases[] = {{4, 1, "is GLB version 1"},
                 {8, 0xffffffff, "is truncated"},
                 {8, 12, "is damaged: it has no JSON"},
                 {12, 0xfffffff0, "is damaged: chunk 0"},
                 {16, 0x004e4942, "is damaged: its first chunk"}};
    for (const auto& [offset, value, start] : cases) {
        std::string damaged = glb;
        std::memcpy(damaged.data() + offset, &value, 4);
        EXPECT_TRUE(refusal_of_bytes(damaged).starts_with(start)) << offset << ": " << refusal_of_bytes(damaged);
    }
    EXPECT_EQ(load_gltf(write("longer.glb", glb + "trailing")).meshes.size(), 1u);
}

TEST_F(GltfContainer, UnusedBuffersMayLackData) {
    GltfBuilder b;
    b.add_triangle();
    b.add_buffer();
    b.push("buffers", {{"byteLength", 1000}});
    EXPECT_EQ(refusal(b), "");
    b.json["bufferViews"][0]["buffer"] = 1;
    EXPECT_TRUE(refusal(b).starts_with("buffers[1]: ")) << refusal(b);
}

}  // namespace
}  // namespace halflight
