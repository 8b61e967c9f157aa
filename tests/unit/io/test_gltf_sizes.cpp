// Tests that what a glTF file takes in memory is known before it is read.
#include <fstream>

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
