// Tests images of glTF files.
#include "tests/support/ktx2.h"
#include "tests/unit/io/gltf_materials.h"

namespace halflight {
namespace {

/// A PNG of 2x1 pixels with 16 bits per channel: (ffff, 8000, 12ff, 0000) and (0100, 00ff, abcd, ffff).
constexpr const char* kPng16 =
    "data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAIAAAABEAYAAACksqPJAAAAGklEQVR4nGP4/7+BQeg/AwMjA8P/1Wf//wcAPtIIBqaX"
    "8jwAAAAASUVORK5CYII=";

TEST_F(GltfMaterials, TexelsAreKeptUnchanged) {
    const std::vector<std::uint8_t> rgba{1, 2, 3, 4, 250, 128, 0, 255};
    material()["pbrMetallicRoughness"]["baseColorTexture"]["index"] = texture("a b.png", rgba);
    b.json["images"][0]["uri"] = "a%20b.png";
    Scene scene = load();
    ASSERT_EQ(scene.images.size(), 1u);
    EXPECT_EQ(scene.images[0].width, 2);
    EXPECT_EQ(scene.images[0].height, 1);
    EXPECT_EQ(scene.images[0].rgba, rgba);
    const std::string bytes = read_file(folder_ / "a b.png", 10000);
    b.json["images"][0] = {{"mimeType", "image/png"},
                           {"bufferView", b.view(std::vector<char>(bytes.begin(), bytes.end()))}};
    EXPECT_EQ(load().images.at(0).rgba, rgba);
    b.json["images"][0] = {{"uri", kPng16}};
    EXPECT_EQ(load().images.at(0).rgba, (std::vector<std::uint8_t>{0xff, 0x80, 0x13, 0x00, 0x01, 0x01, 0xab, 0xff}))
        << "of 16 bits, rounded: 0x12ff is 18.99 / 255, 0x00ff nearly 1 / 255";
}

/// Returns a KTX2 of 2x1 texels without compression. transfer: 1 linear, 2 sRGB, 10 PQ; primaries: 1 BT.709, 4 BT.2020.
std::string small_ktx2(unsigned transfer = 2, unsigned primaries = 1) {
    test::Ktx2 file;
    file.model = 1, file.format = transfer == 2 ? 43 : 37, file.transfer = transfer, file.primaries = primaries;
    file.width = 2, file.height = 1;
    file.pixels = "abcdefgh";
    return test::encode(file);
}

TEST_F(GltfMaterials, ImagesOfExtensionsArePreferred) {
    material()["pbrMetallicRoughness"]["baseColorTexture"]["index"] = texture("plain.png");
    write("a.ktx2", small_ktx2());
    const int image = b.push("images", {{"uri", "a.ktx2"}});
    b.json["textures"][0]["extensions"]["KHR_texture_basisu"]["source"] = image;
    b.json["extensionsUsed"] = {"KHR_texture_basisu"};
    const Scene scene = load();
    ASSERT_EQ(scene.images.size(), 1u);
    EXPECT_EQ(scene.images[0].name, "a.ktx2");
    EXPECT_EQ(std::string(scene.images[0].rgba.begin(), scene.images[0].rgba.end()), "abcdefgh");
    EXPECT_TRUE(scene.report.warnings.empty());
    const auto path = write("scene.glb", b.glb());
    EXPECT_EQ(GltfScene(path).size().texture_bytes, 8u);

    b.json["textures"][0].erase("source");
    b.json["textures"][0]["extensions"]["EXT_texture_webp"]["source"] = 0;  // content decides, so a PNG is read, too
    b.json["textures"][0]["extensions"]["KHR_texture_basisu"].erase("source");
    EXPECT_EQ(load().images.at(0).name, "plain.png");
    b.json["textures"][0]["extensions"]["EXT_texture_webp"]["source"] = 2;
    EXPECT_NE(refusal().find("textures[0].extensions.EXT_texture_webp.source"), std::string::npos) << refusal();
}

TEST_F(GltfMaterials, UnreadableImagesOfOptionalExtensionsAreReplaced) {
    material()["pbrMetallicRoughness"]["baseColorTexture"]["index"] = texture("plain.png");
    b.push("images", {{"uri", "a.ktx2"}});
    b.push("images", {{"uri", "a.webp"}});
    b.json["textures"][0]["extensions"] = {{"KHR_texture_basisu", {{"source", 1}}},
                                           {"EXT_texture_webp", {{"source", 2}}}};
    write("a.ktx2", small_ktx2().substr(0, 100));
    write("a.webp", "RIFF....WEBPVP8 ");
    Scene scene = load();
    ASSERT_EQ(scene.images.size(), 1u);
    EXPECT_EQ(scene.images[0].name, "plain.png");
    ASSERT_EQ(scene.report.warnings.size(), 2u);
    EXPECT_EQ(scene.report.warnings[0],
              "images[1] (a.ktx2): is truncated: its level index is missing; textures use images[0] (plain.png) "
              "instead");
    const auto path = write("scene.glb", b.glb());
    GltfScene posed(path);
    EXPECT_EQ(posed.size().texture_bytes, 4u);
    for (int i = 0; i < 2; ++i) {
        const Scene pose = posed.at(0, {});
        EXPECT_EQ(pose.report.warnings, scene.report.warnings) << "every pose reports them";
        EXPECT_EQ(pose.materials[0].base_color_texture.image, 0);
    }
    GltfOptions strict;
    strict.strict = true;
    EXPECT_EQ(error_message([&] { load_gltf(path, strict); }),
              path.string() + ": images[1] (a.ktx2): is truncated: its level index is missing");

    b.json["textures"][0].erase("source");
    scene = load();
    EXPECT_TRUE(scene.images.empty());
    EXPECT_FALSE(scene.materials[0].base_color_texture);
    EXPECT_TRUE(scene.report.warnings.at(1).starts_with("images[2] (a.webp): cannot be decoded: "))
        << scene.report.warnings[1];
    EXPECT_TRUE(scene.report.warnings[1].ends_with("; textures do without it (--strict: an error)"));
    std::filesystem::remove(folder_ / "a.ktx2");
    EXPECT_TRUE(load().images.empty()) << "a missing file";

    // Two textures that are each other's fallback.
    b.json["textures"] = {{{"source", 1}, {"extensions", {{"EXT_texture_webp", {{"source", 2}}}}}},
                          {{"source", 2}, {"extensions", {{"KHR_texture_basisu", {{"source", 1}}}}}}};
    EXPECT_TRUE(load().images.empty());

    b.json["extensionsRequired"] = {"EXT_texture_webp"};
    b.json["textures"] = {{{"source", 0}, {"extensions", {{"EXT_texture_webp", {{"source", 2}}}}}}};
    EXPECT_TRUE(refusal().starts_with("images[2] (a.webp): cannot be decoded: ")) << refusal();
}

TEST_F(GltfMaterials, ALeftOutGlossinessTextureLeavesTheFactor) {
    b.push("images", {{"uri", "a.webp"}});
    b.push("textures", {{"extensions", {{"EXT_texture_webp", {{"source", 0}}}}}});
    extension("KHR_materials_pbrSpecularGlossiness") = {{"glossinessFactor", 0.75},
                                                        {"specularGlossinessTexture", {{"index", 0}}}};
    EXPECT_EQ(load().materials.at(0).roughness, 0.25f);
    GltfScene scene(write("scene.glb", b.glb()));
    for (int i = 0; i < 2; ++i) EXPECT_EQ(scene.at(0, {}).materials.at(0).roughness, 0.25f);
}

TEST_F(GltfMaterials, TransferFunctionsThatDoNotFitAreReported) {
    write("color.ktx2", small_ktx2(1));
    write("data.ktx2", small_ktx2(2));
    for (const char* uri : {"color.ktx2", "data.ktx2"})
        b.push("textures", {{"extensions", {{"KHR_texture_basisu", {{"source", b.push("images", {{"uri", uri}})}}}}}});
    material()["pbrMetallicRoughness"] = {{"baseColorTexture", {{"index", 0}}},
                                          {"metallicRoughnessTexture", {{"index", 1}}}};
    EXPECT_EQ(load().report.warnings,
              (std::vector<std::string>{
                  "images[0] (color.ktx2): is marked as linear, but used as a colour; its texels are read as sRGB",
                  "images[1] (data.ktx2): is marked as sRGB, but used as data; its texels are read as linear"}));
    material()["pbrMetallicRoughness"] = {{"baseColorTexture", {{"index", 1}}},
                                          {"metallicRoughnessTexture", {{"index", 0}}}};
    EXPECT_TRUE(load().report.warnings.empty());
    write("color.ktx2", small_ktx2(1, 4));
    EXPECT_TRUE(load().report.warnings.empty()) << "primaries are of no use in data";
    write("data.ktx2", small_ktx2(10, 4));
    EXPECT_EQ(load().report.warnings,
              (std::vector<std::string>{"images[1] (data.ktx2): has the transfer function PQ EOTF, which glTF does not "
                                        "allow; its texels are read as sRGB",
                                        "images[1] (data.ktx2): has the colour primaries BT.2020, which glTF does not "
                                        "allow; its colours are read as BT.709"}));
}

TEST_F(GltfMaterials, UnusableImagesAreNamed) {
    material()["pbrMetallicRoughness"]["baseColorTexture"]["index"] = texture("wood.png");
    const std::string png = read_file(folder_ / "wood.png", 10000);
    write("wood.png", png.substr(0, png.size() / 2));
    EXPECT_TRUE(refusal().starts_with("images[0] (wood.png): cannot be decoded")) << refusal();
    write("wood.png", "GIF89a");
    EXPECT_EQ(refusal(), "images[0] (wood.png): is a GIF picture; textures are PNG, JPEG, WebP or KTX2");
    write("wood.png", "wood");
    EXPECT_EQ(refusal(), "images[0] (wood.png): is of an unknown format; textures are PNG, JPEG, WebP or KTX2");
    write("wood.png", "version https://git-lfs.github.com/spec/v1\noid sha256:12\nsize 3\n");
    EXPECT_TRUE(refusal().starts_with("images[0] (wood.png): 'wood.png' is a Git LFS pointer")) << refusal();
    std::filesystem::remove(folder_ / "wood.png");
    EXPECT_TRUE(refusal().starts_with("images[0] (wood.png): ")) << refusal();
    EXPECT_NE(refusal().find("No such file"), std::string::npos);
    write_png(folder_ / "wood.png", 5, 1, 1, std::vector<std::uint8_t>(5));
    GltfOptions options;
    options.max_image_side = 4;
    const auto path = write("scene.glb", b.glb());
    EXPECT_NE(error_message([&] { load_gltf(path, options); }).find("5 x 1 texels are more than 4 a side"),
              std::string::npos);
    b.json["images"][0] = {
        {"bufferView", b.push("bufferViews", {{"buffer", 0}, {"byteOffset", 60}, {"byteLength", 1000}})}};
    EXPECT_EQ(refusal(),
              fmt::format("bufferViews[2]: ends at byte 1060 of buffers[0], which has {}", b.bytes().size()));
}

TEST_F(GltfMaterials, ATextureWithoutReadableImageIsIgnored) {
    material()["pbrMetallicRoughness"]["baseColorTexture"]["index"] = b.push("textures", Json::object());
    b.json["extensionsUsed"] = {"MSFT_texture_dds"};
    const Scene scene = load();
    EXPECT_FALSE(scene.materials[0].base_color_texture);
    EXPECT_EQ(scene.report.warnings,
              (std::vector<std::string>{"extension MSFT_texture_dds is used but not supported; it is ignored",
                                        "textures[0]: has no image, it is not used"}));
}

}  // namespace
}  // namespace halflight
