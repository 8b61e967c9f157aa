// Tests images of glTF files.
#include "tests/support/ktx2.h"
#include "tests/unit/io/gltf_materials.h"

namespace halflight {
namespace {

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
    std::string escaped;
    for (const char c : std::string_view(kPng16))
        escaped += c == '+' || c == '/' || c == '=' ? fmt::format("%{:02X}", c) : std::string(1, c);
    for (const std::string& uri : {std::string(kPng16), escaped}) {
        b.json["images"][0] = {{"uri", uri}};
        scene = load();
        EXPECT_TRUE(scene.images.at(0).deep);
        EXPECT_EQ(scene.images[0].rgba, (std::vector<std::uint8_t>{0xff, 0x80, 0x12, 0x00, 0xff, 0x00, 0xff, 0x00,  //
                                                                   0x01, 0x00, 0xab, 0xff, 0x00, 0xff, 0xcd, 0xff}));
    }
    const SceneSize headers = open(b).size(), loaded = size_of(scene);
    EXPECT_EQ(headers.texture_bytes, 16u);
    EXPECT_EQ(headers.deep_bytes, 8u);
    EXPECT_EQ(loaded.texture_bytes, 16u);
    EXPECT_EQ(loaded.deep_bytes, 8u);
}

TEST_F(GltfMaterials, SixteenBitsThatEightCanHoldTakeEight) {
    Image picture(3, 2, 4);
    for (std::size_t i = 0; i < picture.pixels.size(); ++i) picture.pixels[i] = float(i * 11 % 256) / 255;
    material()["pbrMetallicRoughness"]["baseColorTexture"]["index"] = texture("a.png");
    const auto texels_of = [&](int bits) {
        write("a.png", encode_png("a.png", picture, {.bits = bits}));
        return load().images.at(0);
    };
    const TextureImage eight = texels_of(8), sixteen = texels_of(16);
    EXPECT_FALSE(sixteen.deep);
    EXPECT_EQ(sixteen.rgba, eight.rgba);
    picture.pixels[5] += 1.0f / 65535;
    const TextureImage deep = texels_of(16);
    ASSERT_TRUE(deep.deep);
    for (std::size_t i = 0; i < 6; ++i)
        for (std::size_t c = 0; c < 4; ++c)
            EXPECT_EQ(deep.code(&deep.rgba[8 * i], c), 257u * eight.rgba[4 * i + c] + (4 * i + c == 5 ? 1 : 0));
    EXPECT_EQ(open(b).size().deep_bytes, 24u) << "headers do not tell";
    const std::string bytes = encode_png("a.png", picture, {.bits = 16});
    EXPECT_EQ(read_png_header("a.png", bytes, bytes.size(), 16).decoding_bytes, 24u) << "texels of 8 bits are a copy";
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
    EXPECT_EQ(open(b).size().texture_bytes, 8u);

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
    EXPECT_TRUE(scene.report.warnings[0].starts_with("images[1] (a.ktx2): is truncated: "));
    EXPECT_TRUE(scene.report.warnings[0].ends_with("; textures use images[0] (plain.png) instead"));
    const auto path = write("scene.glb", b.glb());
    GltfScene posed(path);
    EXPECT_EQ(posed.size().texture_bytes, 4u);
    for (int i = 0; i < 2; ++i) {
        const Scene pose = posed.at(0, {});
        EXPECT_EQ(pose.report.warnings, scene.report.warnings) << "every pose reports them";
        EXPECT_EQ(pose.materials[0].base_color_texture.image, 0);
    }
    EXPECT_TRUE(without_name(error_message([&] { load_gltf(path, {.strict = true}); })).starts_with("images[1] "));

    b.json["textures"][0].erase("source");
    scene = load();
    EXPECT_TRUE(scene.images.empty());
    EXPECT_FALSE(scene.materials[0].base_color_texture);
    EXPECT_TRUE(scene.report.warnings.at(1).starts_with("images[2] (a.webp): cannot be decoded: "));
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

TEST_F(GltfMaterials, ImagesThatATextureNeedsAreNotOptional) {
    write("a.webp", "RIFF....WEBPVP8 ");
    material()["pbrMetallicRoughness"]["baseColorTexture"]["index"] = texture("plain.png");
    const int webp = b.push("images", {{"uri", "a.webp"}});
    b.json["textures"][0]["extensions"] = {{"EXT_texture_webp", {{"source", webp}}}};
    EXPECT_EQ(load().images.at(0).name, "plain.png");
    material()["emissiveTexture"]["index"] = b.push("textures", {{"source", webp}});
    EXPECT_TRUE(refusal().starts_with("images[1] (a.webp): cannot be decoded: ")) << refusal();
}

TEST_F(GltfMaterials, ImageFilesAreReadAsAWholeOnlyIfTheirHeadersAreRight) {
    constexpr std::uintmax_t kBytes = std::uintmax_t{64} << 30;  // more than this machine could hold
    const std::filesystem::path large = folder_ / "large.png";
    material()["emissiveTexture"]["index"] = texture("large.png");
    const std::size_t small = open(b).size().decoding_bytes;
    std::filesystem::resize_file(large, kBytes);
    EXPECT_GE(open(b).size().decoding_bytes, small + kBytes - 1000) << "decoders get the whole file";
    write("large.png", "no picture");
    std::filesystem::resize_file(large, kBytes);
    EXPECT_LT(open(b).size().decoding_bytes, 1u << 20);
    EXPECT_TRUE(refusal().starts_with("images[0] (large.png): "));
}

/// Poses read the images of the first one.
TEST_F(GltfMaterials, ImagesAreReadOnceForAllPoses) {
    material()["emissiveTexture"]["index"] = texture("a.png");
    b.animate(0, "translation", b.floats("SCALAR", {0, 1}), b.floats("VEC3", {0, 0, 0, 2, 0, 0}));
    GltfScene file = open(b);
    Scene scene = file.at_rest();
    std::filesystem::remove(folder_ / "a.png");
    file.pose(scene, 1, kFirst);
    EXPECT_EQ(scene.images.size(), 1u);
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
    expect_warnings(load().report.warnings, {"images[0] (color.ktx2): is marked as linear, but used as a colour",
                                             "images[1] (data.ktx2): is marked as sRGB, but used as data"});
    material()["pbrMetallicRoughness"] = {{"baseColorTexture", {{"index", 1}}},
                                          {"metallicRoughnessTexture", {{"index", 0}}}};
    EXPECT_TRUE(load().report.warnings.empty());
    write("color.ktx2", small_ktx2(1, 4));
    EXPECT_TRUE(load().report.warnings.empty()) << "primaries are of no use in data";
    write("data.ktx2", small_ktx2(10, 4));
    expect_warnings(load().report.warnings, {"images[1] (data.ktx2): has the transfer function PQ",
                                             "images[1] (data.ktx2): has the colour primaries BT.2020"});
}

TEST_F(GltfMaterials, UnusableImagesAreNamed) {
    material()["pbrMetallicRoughness"]["baseColorTexture"]["index"] = texture("wood.png");
    const std::string png = read_file(folder_ / "wood.png", 10000);
    const std::string element = "images[0] (wood.png): ";
    const std::pair<std::string, std::string> cases[] = {
        {png.substr(0, png.size() / 2), "cannot be decoded"},
        {"GIF89a", "is a GIF picture"},
        {"wood", "is of an unknown format"},
        {"version https://git-lfs.github.com/spec/v1\noid sha256:12\nsize 3\n", "'wood.png' is a Git LFS pointer"}};
    for (const auto& [bytes, message] : cases) {
        write("wood.png", bytes);
        EXPECT_TRUE(refusal().starts_with(element + message)) << refusal();
    }
    std::filesystem::remove(folder_ / "wood.png");
    EXPECT_TRUE(refusal().starts_with(element) && refusal().ends_with("No such file or directory")) << refusal();
    write_png(folder_ / "wood.png", 5, 1, 1, std::vector<std::uint8_t>(5));
    GltfOptions options;
    options.max_image_side = 4;
    EXPECT_TRUE(without_name(error_message([&] { GltfTest::load(b, options); })).starts_with(element + "5 x 1 texels"));
    const int beyond = b.push("bufferViews", {{"buffer", 0}, {"byteOffset", 60}, {"byteLength", 1000}});
    b.json["images"][0] = {{"bufferView", beyond}};
    EXPECT_TRUE(refusal().starts_with("bufferViews[2]: ends at byte 1060 of buffers[0]")) << refusal();
}

TEST_F(GltfMaterials, ATextureWithoutReadableImageIsIgnored) {
    material()["pbrMetallicRoughness"]["baseColorTexture"]["index"] = b.push("textures", Json::object());
    b.json["extensionsUsed"] = {"MSFT_texture_dds"};
    const Scene scene = load();
    EXPECT_FALSE(scene.materials[0].base_color_texture);
    expect_warnings(scene.report.warnings, {"extension MSFT_texture_dds", "textures[0]: "});
}

}  // namespace
}  // namespace halflight
