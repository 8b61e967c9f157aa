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
    for (const auto& [pointer, list] : cases) {
        for (const Json& wrong : {Json(99), Json(-1), Json(1.5), Json("0"), Json(4294967296u), Json(nullptr)}) {
            GltfBuilder b = everything();
            b.add_buffer();
            b.json[Json::json_pointer(pointer)] = wrong;
            const std::string message = refusal(b);
            EXPECT_TRUE(message.starts_with(subject_of(pointer) + ": ")) << pointer << " " << wrong << ": " << message;
            if (wrong == Json(99)) {
                EXPECT_NE(message.find(fmt::format("99 is not an index into {}", list)), std::string::npos);
            }
        }
    }
}

TEST_F(GltfIndices, AccessorsMustLieWithinTheirBuffers) {
    const auto with = [&](const char* pointer, const Json& value) {
        GltfBuilder b = everything();
        b.json["nodes"][0].erase("skin");
        b.json["materials"][0] = Json::object();
        b.add_buffer();
        b.json[Json::json_pointer(pointer)] = value;
        return refusal(b);
    };
    EXPECT_EQ(with("/asset/generator", "nobody"), "");
    EXPECT_EQ(with("/accessors/0/count", 4), "accessors[0]: ends at byte 48 of bufferViews[0], which has 36");
    EXPECT_EQ(with("/accessors/0/byteOffset", 4), "accessors[0]: ends at byte 40 of bufferViews[0], which has 36");
    EXPECT_EQ(with("/accessors/0/count", 1ull << 53),
              fmt::format("accessors[0]: ends at byte {} of bufferViews[0], which has 36", 12 * (1ull << 53)));
    EXPECT_EQ(with("/accessors/0/count", (1ull << 53) + 1), "accessors[0].count: 9007199254740993 is too large");
    EXPECT_EQ(with("/accessors/0/byteOffset", UINT64_MAX),
              "accessors[0].byteOffset: 18446744073709551615 is too large");
    EXPECT_TRUE(with("/bufferViews/0/byteLength", 1u << 30).starts_with("bufferViews[0]: ends at byte 1073741824 of"));
    EXPECT_TRUE(with("/bufferViews/0/byteOffset", 1ull << 52).starts_with("bufferViews[0]: ends at byte"));
    EXPECT_EQ(with("/bufferViews/0/byteStride", 8), "accessors[0]: elements of 12 bytes overlap, byteStride is 8");
    EXPECT_EQ(with("/accessors/0/type", "VEC2"), "accessors[0]: has 2 components, POSITION needs 3");
    EXPECT_EQ(with("/accessors/0/componentType", 5124), "accessors[0]: componentType 5124 is unknown");
    EXPECT_EQ(with("/accessors/0/componentType", 5130), "accessors[0]: componentType 5130 is unknown");
    EXPECT_EQ(with("/accessors/1/componentType", 5120),
              "accessors[1]: componentType 5120 is not an unsigned integer, indices needs one");
    EXPECT_EQ(with("/meshes/0/primitives/0/mode", 7), "meshes[0].primitives[0]: mode 7 is unknown");
    EXPECT_EQ(with("/meshes/0/primitives/0/attributes/NORMAL", 1), "accessors[1]: has 1 components, NORMAL needs 3");
    EXPECT_EQ(with("/buffers/0/byteLength", 1u << 20).substr(0, 12), "buffers[0]: ");
    EXPECT_EQ(with("/accessors/0/sparse", {{"count", 3}}), "accessors[0].sparse: has no 'indices'");
}

TEST_F(GltfIndices, VerticesMustExist) {
    GltfBuilder b;
    Json& primitive = b.add_triangle();
    primitive["indices"] = b.accessor("SCALAR", kU32, std::vector<std::uint32_t>{0, 1, 2, 2, 3, 1});
    EXPECT_EQ(refusal(b), "meshes[0].primitives[0]: index 3 at place 4 of accessors[1], but there are 3 vertices");
    b = {};
    b.add_triangle()["attributes"]["COLOR_0"] = b.floats("VEC3", {0, 0, 0, 1, 1, 1});
    EXPECT_EQ(refusal(b), "meshes[0].primitives[0]: COLOR_0 has 2 elements for 3 vertices");
    b = {};
    b.add_triangle()["targets"] = {{{"POSITION", b.floats("VEC3", {0, 0, 0})}}};
    b.json["meshes"][0]["weights"] = {1};
    EXPECT_EQ(refusal(b), "meshes[0].primitives[0]: POSITION has 1 elements for 3 vertices");
}

TEST_F(GltfIndices, SparseOnesAreCheckedToo) {
    const auto with = [&](const char* pointer, const Json& value) {
        GltfBuilder b;
        b.add_triangle();
        b.json["accessors"][0]["sparse"] = {
            {"count", 1},
            {"indices", {{"bufferView", b.view(std::vector<std::uint8_t>{2, 3})}, {"componentType", kU8}}},
            {"values", {{"bufferView", b.view(std::vector<float>{0, 1, 0})}}}};
        b.json["accessors"][0]["sparse"][Json::json_pointer(pointer)] = value;
        return refusal(b);
    };
    EXPECT_EQ(with("/count", 1), "");
    EXPECT_EQ(with("/count", 3), "accessors[0].sparse.indices: ends at byte 3 of bufferViews[1], which has 2");
    EXPECT_EQ(with("/count", 2), "accessors[0].sparse.values: ends at byte 24 of bufferViews[2], which has 12");
    EXPECT_EQ(with("/indices/byteOffset", 1), "accessors[0]: sparse index 3 of 3 elements");
    EXPECT_EQ(with("/indices/byteOffset", 4294967296u),
              "accessors[0].sparse.indices.byteOffset: 4294967296 is too large");
    EXPECT_EQ(with("/values/bufferView", 1),
              "accessors[0].sparse.values: ends at byte 12 of bufferViews[1], which has 2");
    EXPECT_EQ(with("/values/bufferView", 9),
              "accessors[0].sparse.values.bufferView: 9 is not an index into "
              "bufferViews, which has 3");
    EXPECT_EQ(with("/indices/componentType", kI8),
              "accessors[0]: sparse indices of componentType 5120 are not unsigned integers");
}

TEST_F(GltfIndices, AccessorsWithoutBufferAreLimited) {
    GltfBuilder b;
    b.add_triangle();
    b.json["accessors"][0].erase("bufferView");
    b.json["accessors"][0]["count"] = 1ull << 40;
    EXPECT_TRUE(refusal(b).starts_with("meshes[0].primitives[0]: 1099511627776 vertices are more than")) << refusal(b);
    b.json["accessors"][0]["count"] = 1u << 31;
    b.json["meshes"][0]["primitives"][0]["indices"] = b.accessor("SCALAR", kU8, std::vector<std::uint8_t>{0, 1, 2});
    EXPECT_TRUE(refusal(b).starts_with("accessors[0]: 2147483648 elements without a bufferView")) << refusal(b);
}

TEST_F(GltfIndices, NodesMustMakeATree) {
    GltfBuilder b;
    for (const int child : {1, 2, 0}) b.push("nodes", {{"children", {child}}});
    b.push("nodes", Json::object());
    EXPECT_EQ(refusal(b), "nodes[0]: is its own ancestor");
    b = {};
    b.push("nodes", {{"children", {0}}});
    EXPECT_EQ(refusal(b), "nodes[0]: is its own ancestor");
    b = {};
    b.push("nodes", {{"children", {2}}});
    b.push("nodes", {{"children", {2}}});
    b.push("nodes", Json::object());
    EXPECT_EQ(refusal(b), "nodes[2]: is a child of both nodes[0] and nodes[1]");
    b = {};
    b.push("nodes", {{"scale", {1e300, 1, 1}}, {"children", {1}}});
    b.push("nodes", {{"scale", {1e300, 1, 1}}});
    EXPECT_EQ(refusal(b), "nodes[0]: its transform overflows");
}

TEST_F(GltfText, FilesOfOtherProgramsAreNamed) {
    using namespace std::literals;
    const std::pair<std::string, const char*> cases[] = {
        {"BLENDER-v300RENDH", "a Blender file"},
        {"\x28\xb5\x2f\xfd\0\0"s, "a Zstandard file, such as a compressed Blender file"},
        {"Kaydara FBX Binary  \0\x1a\0"s, "an FBX file"},
        {"; FBX 7.3.0 project file", "an FBX file"},
        {"# Blender 4.0\n\nmtllib a.mtl\no Cube\n", "a Wavefront OBJ file"},
        {"#usda 1.0\n(\n)", "a USD file"},
        {"PXR-USDC\0\x08"s, "a USD file"},
        {"PK\3\4\x14\0"s, "a ZIP archive, such as USDZ"},
        {"<?xml version=\"1.0\"?>\n<COLLADA xmlns=\"\">", "a Collada file"},
        {std::string(80, ' ') + "\1\0\0\0"s + std::string(50, '\0'), "an STL file"},
        {"ply\nformat ascii 1.0\n", "a PLY file"},
        {"Ogawa\xff\0\1"s, "an Alembic file"},
        {"RIFF\0\0\0\0WEBP"s, "a WebP picture"},
        {"\0\0\0\x1c"
         "ftypavif"s,
         "an AVIF picture"},
    };
    for (const auto& [text, kind] : cases)
        EXPECT_EQ(refusal_of_text(text), std::string("is ") + kind + "; export glTF 2.0 (.glb) instead");
    EXPECT_EQ(refusal_of_text("\x89HLP\r\n\x1a\n"), "is a page file of Halflight; name the scene that it was made of");
    EXPECT_EQ(refusal_of_text(R"({"parts": []})"), "is a list of files, whose name must end with .parts.json");
}

TEST_F(GltfText, OtherFormatsAreRefused) {
    const std::string asset = R"({"asset": {"version": "2.0"})";
    EXPECT_EQ(refusal_of_text(asset + "}"), "");
    EXPECT_EQ(refusal_of_text("\xef\xbb\xbf" + asset + "}"), "") << "a byte order mark";
    EXPECT_EQ(refusal_of_text(""), "is empty");
    EXPECT_EQ(refusal_of_text("solid cube"), "is an STL file; export glTF 2.0 (.glb) instead");
    EXPECT_EQ(refusal_of_text("a cube"), "is neither GLB nor glTF's JSON");
    EXPECT_EQ(refusal_of_text("{}"), "has no 'asset'");
    EXPECT_TRUE(refusal_of_text(asset).starts_with("parse error at line 1")) << refusal_of_text(asset);
    EXPECT_EQ(refusal_of_text(R"({"asset": {"version": "1.0"}})"), "is glTF 1.0, only 2.0 is supported");
    EXPECT_EQ(refusal_of_text(R"({"asset": {"version": 1.0}, "scenes": {"main": {}}})"),
              "is glTF 1.0, only 2.0 is supported");
    EXPECT_EQ(refusal_of_text(R"({"nodes": {"root": {}}})"), "is glTF 1.0, only 2.0 is supported");
    EXPECT_EQ(refusal_of_text(R"({"asset": {"version": "2.0"}, "nodes": {}})"), "nodes: is not an array");
    EXPECT_EQ(refusal_of_text(R"({"asset": {"version": "2.1", "minVersion": "2.1"}})"),
              "is glTF 2.1, only 2.0 is supported");
    EXPECT_EQ(refusal_of_text(asset + R"(, "nodes": {}})"), "nodes: is not an array");
    EXPECT_EQ(refusal_of_text(asset + R"(, "nodes": [1]})"), "nodes[0]: is not an object");
    EXPECT_EQ(refusal_of_text(asset + R"(, "nodes": [{"scale": [1, 2]}]})"), "nodes[0].scale: has 2 numbers, not 3");
    EXPECT_EQ(refusal_of_text(asset + R"(, "nodes": [{"scale": [1, 2, "3"]}]})"), "nodes[0].scale[2]: is not a number");
    EXPECT_NE(refusal_of_text(asset + R"(, "nodes": [{"scale": [1, 2, 1e999]}]})"), "");
    EXPECT_EQ(refusal_of_text(asset + R"(, "materials": [{"pbrMetallicRoughness": {"metallicFactor": true}}]})"),
              "materials[0].pbrMetallicRoughness.metallicFactor: is not a number");
    EXPECT_EQ(refusal_of_text(asset + R"(, "materials": [{"extensions": {"KHR_materials_ior": 3}}]})"),
              "materials[0].extensions.KHR_materials_ior: is not an object");
}

TEST_F(GltfText, DeepNestingIsRefused) {
    for (const int depth : {1000, 1000000}) {
        const std::string text =
            R"({"asset": {"version": "2.0", "extras": )" + std::string(static_cast<std::size_t>(depth), '[');
        EXPECT_EQ(refusal_of_text(text), "JSON is nested deeper than 256 levels");
    }
}

TEST_F(GltfText, RequiredExtensionsAreNamed) {
    const std::string text =
        R"({"asset": {"version": "2.0"}, "extensionsUsed": ["X_c", "X_b", "X_a"],
        "extensionsRequired": ["KHR_lights_punctual", "X_c", "X_a"]})";
    EXPECT_EQ(refusal_of_text(text), "requires what is not supported: X_c, X_a");
}

TEST_F(GltfText, UnknownUsedExtensionsGiveAWarning) {
    const Scene scene =
        load_text(R"({"asset": {"version": "2.0"}, "extensionsUsed": ["X_b", "KHR_materials_ior", "X_b"]})");
    EXPECT_EQ(scene.report.warnings,
              (std::vector<std::string>{"extension X_b is used but not supported; it is ignored"}));
}

/// Returns JSON with a buffer at `uri`.
std::string with_buffer(const std::string& uri, int length = 36) {
    return Json{{"asset", {{"version", "2.0"}}},
                {"buffers", {{{"uri", uri}, {"byteLength", length}}}},
                {"bufferViews", {{{"buffer", 0}, {"byteLength", 36}}}},
                {"accessors", {{{"bufferView", 0}, {"componentType", kF32}, {"count", 3}, {"type", "VEC3"}}}},
                {"meshes", {{{"primitives", {{{"attributes", {{"POSITION", 0}}}}}}}}},
                {"nodes", {{{"mesh", 0}}}}}
        .dump();
}

std::string triangle_bytes() {
    const std::vector<float> positions{0, 0, 0, 1, 0, 0, 0, 1, 0};
    return {reinterpret_cast<const char*>(positions.data()), 36};
}

TEST_F(GltfFiles, BuffersBesideTheScene) {
    fs::create_directory(folder_ / "sub");
    write("sub/b+ü.bin", triangle_bytes() + "more than is needed");
    for (const char* uri : {"sub/b+ü.bin", "sub/b+%C3%bc.bin", "./sub/../sub/b%2B%c3%BC.bin"}) {
        const Scene scene = load_text(with_buffer(uri));
        EXPECT_EQ(scene.meshes.at(0).positions[2], vec3(0, 1, 0)) << uri;
    }
    EXPECT_EQ(refusal_of_text(with_buffer("sub/b+ü.bin", 100)), "buffers[0]: 55 bytes, but byteLength is 100");
    EXPECT_NE(refusal_of_text(with_buffer("none.bin")).find("No such file"), std::string::npos);
    EXPECT_EQ(refusal_of_text(with_buffer("sub")).substr(0, 12), "buffers[0]: ");
}

TEST_F(GltfFiles, DataUris) {
    EXPECT_EQ(load_text(with_buffer("data:application/octet-stream;base64,"
                                    "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"))
                  .meshes.at(0)
                  .positions[1],
              vec3(1, 0, 0));
    EXPECT_EQ(refusal_of_text(with_buffer("data:;base64,AAA*")), "buffers[0]: its data URI is malformed");
    EXPECT_EQ(refusal_of_text(with_buffer("data:;base64,AAAAA")), "buffers[0]: its data URI is malformed");
    EXPECT_EQ(refusal_of_text(with_buffer("data:;base64")), "buffers[0]: its data URI is malformed");
    EXPECT_EQ(refusal_of_text(with_buffer("data:;base64,AAAA")), "buffers[0]: 3 bytes, but byteLength is 36");
}

TEST_F(GltfFiles, NothingOutsideTheFolderIsRead) {
    fs::create_directory(folder_ / "inner");
    write("secret.bin", triangle_bytes());
    fs::create_symlink("../secret.bin", folder_ / "inner/link.bin");
    const fs::path scene = folder_ / "inner/scene.gltf";
    GltfOptions trusting;
    trusting.allow_outside_folder = true;
    const std::string absolute = (folder_ / "secret.bin").string();
    for (const std::string& uri : {std::string("../secret.bin"), std::string("%2e%2e/secret.bin"),
                                   std::string("x/../../secret.bin"), absolute, std::string("link.bin")}) {
        write("inner/scene.gltf", with_buffer(uri));
        const std::string message = error_message([&] { load_gltf(scene); });
        EXPECT_NE(message.find("buffers[0]: "), std::string::npos) << message;
        EXPECT_NE(message.find("outside the scene's folder"), std::string::npos) << message;
        // No folder x exists, so the system cannot resolve a path through it.
        const bool exists = uri[0] != 'x';
        EXPECT_EQ(error_message([&] { load_gltf(scene, trusting); }).empty(), exists) << uri;
    }
    for (const char* uri : {"http://host/a.bin", "file:///etc/passwd", "C:/a.bin"}) {
        write("inner/scene.gltf", with_buffer(uri));
        EXPECT_NE(error_message([&] { load_gltf(scene, trusting); }).find("cannot follow a URI"), std::string::npos);
    }
    EXPECT_NE(refusal_of_text(with_buffer("a%00b")), "");
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
    std::string text = with_buffer("a.bin");
    write("short.gltf", text);
    text.replace(text.rfind("\"byteLength\":36"), 15, fmt::format("\"byteLength\":{}", size));
    const fs::path scene = write("scene.gltf", text);
    for (const fs::path& file : {scene, folder_ / "short.gltf"}) {
        GltfScene open(file);
        EXPECT_EQ(open.at_rest().meshes.at(0).triangles.size(), 1u) << file;
        fs::resize_file(bin, size - 1);
        EXPECT_NE(error_message([&] { open.at_rest(); }).find("a.bin: cannot read: was changed while it was read"),
                  std::string::npos);
        fs::resize_file(bin, size);
    }
}

TEST_F(GltfFiles, LfsPointersAreDetected) {
    const std::string pointer = "version https://git-lfs.github.com/spec/v1\noid sha256:0123\nsize 36\n";
    write("a.bin", pointer);
    EXPECT_EQ(refusal_of_text(with_buffer("a.bin")),
              "buffers[0]: 'a.bin' is a Git LFS pointer, not the file itself (git lfs pull fetches it)");
    EXPECT_EQ(refusal_of_text(pointer), "is a Git LFS pointer, not the file itself (git lfs pull fetches it)");
}

TEST_F(GltfFiles, MissingScene) {
    EXPECT_NE(error_message([&] { load_gltf(folder_ / "none.glb"); }).find("No such file"), std::string::npos);
    EXPECT_NE(error_message([&] { load_gltf(folder_.path); }).find("directory"), std::string::npos);
}

TEST_F(GltfContainer, DamageAnywhereIsRefused) {
    GltfBuilder b;
    b.add_triangle();
    const std::string glb = b.glb();
    for (std::size_t length = 0; length < glb.size(); ++length) {
        const fs::path path = write("cut.glb", glb.substr(0, length));
        EXPECT_NE(error_message([&] { load_gltf(path); }), "") << length;
    }
    const auto with = [&](std::size_t offset, std::uint32_t value) {
        std::string damaged = glb;
        std::memcpy(damaged.data() + offset, &value, 4);
        const fs::path path = write("damaged.glb", damaged);
        return without_name(error_message([&] { load_gltf(path); }));
    };
    EXPECT_EQ(with(4, 1), "is GLB version 1, only 2 is supported");
    EXPECT_EQ(with(8, 0xffffffff),
              fmt::format("is truncated: it has {} of the {} bytes in its header", glb.size(), 0xffffffff));
    EXPECT_EQ(with(8, 12), "is damaged: it has no JSON");
    EXPECT_EQ(with(12, 0xfffffff0), "is damaged: chunk 0 does not fit into the file");
    EXPECT_EQ(with(16, 0x004e4942), "is damaged: its first chunk and no other must be JSON");
    EXPECT_EQ(load_gltf(write("longer.glb", glb + "trailing")).meshes.size(), 1u);
}

TEST_F(GltfContainer, UnusedBuffersMayLackData) {
    GltfBuilder b;
    b.add_triangle();
    b.add_buffer();
    b.push("buffers", {{"byteLength", 1000}});
    EXPECT_EQ(refusal(b), "");
    b.json["bufferViews"][0]["buffer"] = 1;
    EXPECT_EQ(refusal(b), "buffers[1]: has no URI, and there is no binary chunk for it");
}

}  // namespace
}  // namespace halflight
