// Tests that what a glTF file takes in memory is known before it is read.
#include <fstream>

#include "engine/core/memory_ledger.h"
#include "engine/io/gltf/parts.h"
#include "engine/io/png.h"
#include "tests/unit/io/gltf_builder.h"

namespace halflight {
namespace {

namespace fs = std::filesystem;

class GltfSizes : public GltfTest {
  protected:
    /// Returns a scene of one triangle with a texture from a file in the folder.
    GltfBuilder with_image(const std::string& uri) const {
        GltfBuilder b;
        Json& primitive = b.add_triangle();
        primitive["material"] = 0;
        primitive["attributes"]["TEXCOORD_0"] = b.floats("VEC2", {0, 1, 1, 1, 0, 0});
        b.push("textures", {{"source", b.push("images", {{"uri", uri}})}});
        b.json["materials"] = {{{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}}};
        return b;
    }
    std::size_t decoding_bytes(const GltfBuilder& b) const {
        return GltfScene(write("scene.glb", b.glb())).size().decoding_bytes;
    }
};

TEST_F(GltfSizes, ImageFilesAreReadAsAWholeOnlyIfTheirHeadersAreRight) {
    constexpr std::uintmax_t kBytes = std::uintmax_t{64} << 30;  // more than this machine could hold
    write("large.png", "no picture");
    fs::resize_file(folder_ / "large.png", kBytes);
    const GltfBuilder b = with_image("large.png");
    EXPECT_LT(decoding_bytes(b), 1u << 20);
    EXPECT_EQ(refusal(b), "images[0] (large.png): is of an unknown format; textures are PNG, JPEG, WebP or KTX2");

    fs::remove(folder_ / "large.png");
    write_png(folder_ / "large.png", 1, 1, 4, std::vector<std::uint8_t>(4, 255));
    const std::size_t small = decoding_bytes(b);
    fs::resize_file(folder_ / "large.png", kBytes);
    EXPECT_GE(decoding_bytes(b), small + kBytes - 1000) << "decoders get the whole file";
}

TEST_F(GltfSizes, InstancesHaveNames) {
    GltfBuilder b;
    b.add_triangle();
    constexpr std::size_t kCount = 1000, kName = 5000;
    const int translation = b.floats("VEC3", std::vector<float>(3 * kCount));
    b.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"]["TRANSLATION"] = translation;
    const auto size = [&] { return GltfScene(write("scene.glb", b.glb())).size().instance_bytes; };
    const std::size_t without = size();
    for (const char* list : {"meshes", "nodes"}) {
        b.json[list][0]["name"] = std::string(kName, 'n');
        EXPECT_EQ(size(), without + kCount * kName) << list;
        EXPECT_EQ(load(b).instances.at(kCount - 1).name.size(), kName) << list;
    }
}

TEST_F(GltfSizes, FlatInstancesHaveMeshesOfTheirOwn) {
    constexpr std::size_t kFlat = 40, kAll = 50;
    std::vector<float> scales;
    for (std::size_t i = 0; i < kAll; ++i) scales.insert(scales.end(), {1, 1, i < kFlat ? 0.0f : 1.0f});
    GltfBuilder instanced;
    instanced.add_triangle();
    const SceneSize one = GltfScene(write("scene.glb", instanced.glb())).size();
    GltfBuilder nodes = instanced;
    instanced.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"]["SCALE"] =
        instanced.floats("VEC3", scales);
    nodes.json["nodes"].clear();
    for (std::size_t i = 0; i < kAll; ++i)
        nodes.push("nodes", {{"mesh", 0}, {"scale", {scales[3 * i], scales[3 * i + 1], scales[3 * i + 2]}}});
    for (const GltfBuilder& b : {instanced, nodes}) {
        EXPECT_EQ(load(b).meshes.size(), kFlat + 1);
        const SceneSize size = GltfScene(write("scene.glb", b.glb())).size();
        EXPECT_EQ(size.stored, kFlat + 1);
        EXPECT_EQ(size.geometry_bytes, (kFlat + 1) * one.geometry_bytes);
        EXPECT_EQ(size.drawn, kAll);
        EXPECT_GE(size.instance_bytes, kAll * one.instance_bytes + kFlat * sizeof(Mesh));
    }
}

/// Sets the memory that is left, bytes, until it is destroyed.
class MemoryLeft {
  public:
    explicit MemoryLeft(std::size_t bytes) { memory_.set_limit(limit_ - memory_.free() + bytes); }
    ~MemoryLeft() { memory_.set_limit(limit_); }
    MemoryLeft(const MemoryLeft&) = delete;
    MemoryLeft& operator=(const MemoryLeft&) = delete;

  private:
    MemoryLedger& memory_ = MemoryLedger::process();
    const std::size_t limit_ = memory_.limit();
};

TEST_F(GltfSizes, KeyframesOfManySamplersThatShareAccessors) {
    constexpr std::size_t kKeys = 1000, kSamplers = 100, kBytes = kKeys * 4 * sizeof(float);
    GltfBuilder b;
    b.add_triangle();
    std::vector<float> times(kKeys);
    for (std::size_t i = 0; i < kKeys; ++i) times[i] = static_cast<float>(i);
    const int input = b.floats("SCALAR", times), output = b.floats("VEC3", std::vector<float>(3 * kKeys));
    Json animation;
    for (std::size_t i = 0; i < kSamplers; ++i) {
        animation["samplers"].push_back({{"input", input}, {"output", output}});
        animation["channels"].push_back({{"sampler", i}, {"target", {{"node", 0}, {"path", "translation"}}}});
    }
    b.push("animations", animation);
    GltfScene refused(write("refused.glb", b.glb())), read(write("read.glb", b.glb()));
    const std::size_t before = MemoryLedger::process().bytes(MemoryPart::scene);
    {
        const MemoryLeft half(kSamplers * kBytes / 2);
        const std::string message = error_message([&] { refused.animations(); });
        EXPECT_NE(message.find("animations[0].samplers[49]"), std::string::npos) << message;
    }
    const MemoryLeft enough((kSamplers + 1) * kBytes);
    EXPECT_EQ(read.animations().at(0).keyframes.size(), kSamplers);
    EXPECT_GE(MemoryLedger::process().bytes(MemoryPart::scene), before + kSamplers * kBytes);
}

TEST_F(GltfSizes, JsonOfManySmallValues) {
    constexpr std::size_t kCount = 100000;
    const auto refused = [&](const std::string& name, const std::string& value, std::size_t bytes_left) {
        std::string json = R"({"asset": {"version": "2.0"}, "x": [)";
        for (std::size_t i = 0; i < kCount; ++i) json += value + ',';
        json += "0]}";
        const std::filesystem::path file = write(name, json);
        const MemoryLeft left(bytes_left);
        const std::string message =
            error_message([&] { is_part_list(file) ? open_files(file).clear() : void(GltfScene(file)); });
        return message.find("objects and arrays of JSON") != std::string::npos;
    };
    // Each number takes 16 bytes, and each string 64 with its place in the array.
    for (const char* name : {"scene.gltf", "list.parts.json"}) {
        EXPECT_TRUE(refused(name, "0", kCount * 16)) << name;
        EXPECT_TRUE(refused(name, R"("")", kCount * 64)) << name;
        EXPECT_TRUE(refused(name, R"(",:[")", kCount * 64)) << name;
        EXPECT_FALSE(refused(name, R"(",:[{,:[{,")", kCount * 160)) << name << ": text of a string is no structure";
    }
}

TEST_F(GltfSizes, ImagesThatATextureNeedsAreNotOptional) {
    write("a.webp", "RIFF....WEBPVP8 ");
    write_png(folder_ / "plain.png", 1, 1, 4, std::vector<std::uint8_t>(4, 255));
    GltfBuilder b = with_image("plain.png");
    b.push("images", {{"uri", "a.webp"}});
    b.json["textures"][0]["extensions"] = {{"EXT_texture_webp", {{"source", 1}}}};
    EXPECT_EQ(load(b).images.at(0).name, "plain.png");
    b.push("textures", {{"source", 1}});
    b.json["materials"][0]["emissiveTexture"] = {{"index", 1}};
    EXPECT_TRUE(refusal(b).starts_with("images[1] (a.webp): cannot be decoded: ")) << refusal(b);
}

}  // namespace
}  // namespace halflight
