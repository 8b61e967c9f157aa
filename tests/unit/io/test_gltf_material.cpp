// Tests materials, textures, images, lights and cameras of glTF files.
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "engine/io/files.h"
#include "engine/io/png.h"
#include "tests/support/ktx2.h"
#include "tests/unit/io/gltf_builder.h"

namespace halflight {
namespace {

/// A PNG of 2x1 pixels with 16 bits per channel: (ffff, 8000, 12ff, 0000) and (0100, 00ff, abcd, ffff).
constexpr const char* kPng16 =
    "data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAIAAAABEAYAAACksqPJAAAAGklEQVR4nGP4/7+BQeg/AwMjA8P/1Wf//wcAPtIIBqaX"
    "8jwAAAAASUVORK5CYII=";

/// Fixture with a triangle, its texture coordinates, and a material that tests fill in.
class GltfMaterials : public GltfTest {
  protected:
    void SetUp() override {
        GltfTest::SetUp();
        Json& primitive = b.add_triangle();
        primitive["material"] = 0;
        primitive["attributes"]["TEXCOORD_0"] = b.floats("VEC2", {0, 1, 1, 1, 0, 0});
        b.json["materials"] = {Json::object()};
    }
    Json& material() { return b.json["materials"][0]; }
    Json& extension(const char* name) { return material()["extensions"][name]; }

    /// Adds a texture whose image is a new file; returns its index.
    int texture(const std::string& uri, std::vector<std::uint8_t> rgba = {255, 255, 255, 255}) {
        // write_png() waits for the disk, so this cache lets it write each picture only once.
        static std::map<std::string, std::string> encoded;
        std::string& bytes = encoded[std::string(rgba.begin(), rgba.end())];
        if (bytes.empty()) {
            write_png(folder_ / uri, static_cast<int>(rgba.size() / 4), 1, 4, rgba);
            bytes = read_file(folder_ / uri, 10000);
        }
        write(uri, bytes);
        return b.push("textures", {{"source", b.push("images", {{"uri", uri}})}});
    }
    Scene load() { return GltfTest::load(b); }
    std::string refusal() { return GltfTest::refusal(b); }

    GltfBuilder b;
};

TEST_F(GltfMaterials, DefaultsFollowTheSpecification) {
    const Material m = load().materials.at(0);
    EXPECT_EQ(m.base_color, vec4(1));
    EXPECT_EQ(m.metallic, 1);
    EXPECT_EQ(m.roughness, 1);
    EXPECT_EQ(m.emission, vec3(0));
    EXPECT_EQ(m.alpha_mode, AlphaMode::opaque);
    EXPECT_EQ(m.ior, 1.5f);
    EXPECT_EQ(m.specular, 1);
    EXPECT_EQ(m.clearcoat, 0);
    EXPECT_EQ(m.transmission, 0);
    EXPECT_FALSE(m.unlit || m.double_sided || m.base_color_texture || m.normal_texture);
}

TEST_F(GltfMaterials, FactorsAndExtensions) {
    material().update(
        {{"name", "all"},
         {"alphaMode", "MASK"},
         {"alphaCutoff", 0.25},
         {"doubleSided", true},
         {"emissiveFactor", {1, 0.5, 0}},
         {"pbrMetallicRoughness",
          {{"baseColorFactor", {0.1, 0.2, 0.3, 0.4}}, {"metallicFactor", 0}, {"roughnessFactor", 0.75}}}});
    extension("KHR_materials_emissive_strength") = {{"emissiveStrength", 3000000000}};
    extension("KHR_materials_ior") = {{"ior", 2}};
    extension("KHR_materials_specular") = {{"specularFactor", 0.5}, {"specularColorFactor", {1, 2, 0}}};
    extension("KHR_materials_clearcoat") = {{"clearcoatFactor", 1}, {"clearcoatRoughnessFactor", 0.125}};
    extension("KHR_materials_transmission") = {{"transmissionFactor", 0.875}};
    extension("KHR_materials_dispersion") = {{"dispersion", 0.625}};
    extension("KHR_materials_volume") = {
        {"thicknessFactor", 2}, {"attenuationDistance", 0.5}, {"attenuationColor", {1, 0.5, 0.25}}};
    extension("KHR_materials_diffuse_transmission") = {{"diffuseTransmissionFactor", 0.625},
                                                       {"diffuseTransmissionColorFactor", {0.5, 0.75, 0.25}}};
    extension("KHR_materials_sheen") = {{"sheenColorFactor", {0.5, 0.25, 1}}, {"sheenRoughnessFactor", 0.375}};
    extension("KHR_materials_anisotropy") = {{"anisotropyStrength", 0.75}, {"anisotropyRotation", -1.5}};
    extension("KHR_materials_iridescence") = {{"iridescenceFactor", 0.25},
                                              {"iridescenceIor", 1.75},
                                              {"iridescenceThicknessMinimum", 50},
                                              {"iridescenceThicknessMaximum", 750}};
    const Scene scene = load();
    const Material& m = scene.materials.at(0);
    EXPECT_EQ(m.name, "all");
    EXPECT_EQ(m.alpha_mode, AlphaMode::mask);
    EXPECT_EQ(m.alpha_cutoff, 0.25f);
    EXPECT_TRUE(m.double_sided);
    EXPECT_EQ(m.emission, vec3(3e9f, 1.5e9f, 0));
    EXPECT_EQ(m.base_color, vec4(0.1f, 0.2f, 0.3f, 0.4f));
    EXPECT_EQ(m.metallic, 0);
    EXPECT_EQ(m.roughness, 0.75f);
    EXPECT_EQ(m.ior, 2);
    EXPECT_EQ(m.specular, 0.5f);
    EXPECT_EQ(m.specular_color, vec3(1, 2, 0));
    EXPECT_EQ(m.clearcoat, 1);
    EXPECT_EQ(m.clearcoat_roughness, 0.125f);
    EXPECT_EQ(m.transmission, 0.875f);
    EXPECT_EQ(m.dispersion, 0.625f);
    EXPECT_EQ(m.thickness, 2);
    EXPECT_EQ(m.attenuation_distance, 0.5f);
    EXPECT_EQ(m.attenuation_color, vec3(1, 0.5f, 0.25f));
    EXPECT_EQ(m.sheen_color, vec3(0.5f, 0.25f, 1));
    EXPECT_EQ(m.diffuse_transmission, 0.625f);
    EXPECT_EQ(m.diffuse_transmission_color, vec3(0.5f, 0.75f, 0.25f));
    EXPECT_EQ(m.sheen_roughness, 0.375f);
    EXPECT_EQ(m.anisotropy_strength, 0.75f);
    EXPECT_EQ(m.anisotropy_rotation, -1.5f);
    EXPECT_EQ(m.iridescence, 0.25f);
    EXPECT_EQ(m.iridescence_ior, 1.75f);
    EXPECT_EQ(m.iridescence_thickness_minimum, 50);
    EXPECT_EQ(m.iridescence_thickness_maximum, 750);
    EXPECT_TRUE(scene.report.warnings.empty());
}

TEST_F(GltfMaterials, UnlitShowsItsColourOnly) {
    extension("KHR_materials_unlit") = Json::object();
    material()["emissiveFactor"] = {1, 1, 1};
    const Material m = load().materials.at(0);
    EXPECT_TRUE(m.unlit);
    EXPECT_EQ(m.emission, vec3(0));
}

TEST_F(GltfMaterials, ValuesOutsideTheirRangesAreClampedAndReported) {
    material().update(
        {{"alphaMode", "GLASS"}, {"pbrMetallicRoughness", {{"roughnessFactor", -1}, {"metallicFactor", 7}}}});
    extension("KHR_materials_ior") = {{"ior", 0.5}};
    const Scene scene = load();
    EXPECT_EQ(scene.materials[0].roughness, 0);
    EXPECT_EQ(scene.materials[0].metallic, 1);
    EXPECT_EQ(scene.materials[0].ior, 1);
    EXPECT_EQ(scene.report.warnings.size(), 4u);
    EXPECT_EQ(scene.report.warnings.at(1), "materials[0]: metallicFactor is outside [0, 1], clamped");
}

TEST_F(GltfMaterials, AnIndexOfRefractionOfZeroReflectsAll) {
    extension("KHR_materials_ior") = {{"ior", 0}};
    const Material m = load().materials.at(0);
    const float f0 = std::pow((m.ior - 1) / (m.ior + 1), 2.0f) * m.specular_color.r;
    EXPECT_FLOAT_EQ(f0, 1);
}

TEST_F(GltfMaterials, SpecularGlossinessKeepsItsReflectances) {
    const int image = texture("sg.png", {255, 0, 0, 0, 0, 255, 0, 255, 0, 0, 0, 102});
    extension("KHR_materials_pbrSpecularGlossiness") = {{"diffuseFactor", {0.5, 0.25, 0, 1}},
                                                        {"specularFactor", {0.02, 0.5, 1}},
                                                        {"glossinessFactor", 0.5},
                                                        {"specularGlossinessTexture", {{"index", image}}}};
    const Scene scene = load();
    const Material& m = scene.materials.at(0);
    EXPECT_EQ(m.base_color, vec4(0.5f, 0.25f, 0, 1));
    EXPECT_EQ(m.metallic, 0);
    EXPECT_EQ(m.roughness, 1);
    EXPECT_LT(glm::distance(m.specular_color * 0.04f, vec3(0.02f, 0.5f, 1)), 1e-6f);
    ASSERT_EQ(scene.images.size(), 2u);
    EXPECT_EQ(m.specular_color_texture.image, 0);
    ASSERT_EQ(m.metallic_roughness_texture.image, 1);
    const auto& roughness = scene.images[1].rgba;
    EXPECT_EQ(roughness[1], 255) << "no glossiness";
    EXPECT_EQ(roughness[5], 128) << "half of it";
    EXPECT_EQ(roughness[9], 204);
}

TEST_F(GltfMaterials, TexturesOfEveryKind) {
    const auto info = [&](const char* uri) { return Json{{"index", texture(uri)}}; };
    Json normal = info("normal.png");
    normal["scale"] = 0.5;
    Json coat_normal = info("coat_normal.png");
    coat_normal["scale"] = 2;
    material().update({{"pbrMetallicRoughness",
                        {{"baseColorTexture", info("base.png")}, {"metallicRoughnessTexture", info("mr.png")}}},
                       {"normalTexture", normal},
                       {"emissiveTexture", info("emission.png")},
                       {"occlusionTexture", info("unused.png")}});
    extension("KHR_materials_specular") = {{"specularTexture", info("specular.png")},
                                           {"specularColorTexture", info("specular_color.png")}};
    extension("KHR_materials_clearcoat") = {{"clearcoatTexture", info("coat.png")},
                                            {"clearcoatRoughnessTexture", info("coat_roughness.png")},
                                            {"clearcoatNormalTexture", coat_normal}};
    extension("KHR_materials_transmission") = {{"transmissionTexture", info("transmission.png")}};
    extension("KHR_materials_sheen") = {{"sheenColorTexture", info("sheen_color.png")},
                                        {"sheenRoughnessTexture", info("sheen_roughness.png")}};
    extension("KHR_materials_diffuse_transmission") = {{"diffuseTransmissionTexture", info("leaf.png")},
                                                       {"diffuseTransmissionColorTexture", info("leaf_color.png")}};
    extension("KHR_materials_anisotropy")["anisotropyTexture"] = info("anisotropy.png");
    extension("KHR_materials_iridescence") = {{"iridescenceTexture", info("film.png")},
                                              {"iridescenceThicknessTexture", info("thickness.png")}};
    const Scene scene = load();
    const Material& m = scene.materials.at(0);
    const auto name = [&](const TextureRef& t) { return scene.images.at(static_cast<std::size_t>(t.image)).name; };
    EXPECT_EQ(name(m.base_color_texture), "base.png");
    EXPECT_EQ(name(m.metallic_roughness_texture), "mr.png");
    EXPECT_EQ(name(m.normal_texture), "normal.png");
    EXPECT_EQ(name(m.emission_texture), "emission.png");
    EXPECT_EQ(name(m.specular_texture), "specular.png");
    EXPECT_EQ(name(m.specular_color_texture), "specular_color.png");
    EXPECT_EQ(name(m.clearcoat_texture), "coat.png");
    EXPECT_EQ(name(m.clearcoat_roughness_texture), "coat_roughness.png");
    EXPECT_EQ(name(m.clearcoat_normal_texture), "coat_normal.png");
    EXPECT_EQ(name(m.transmission_texture), "transmission.png");
    EXPECT_EQ(name(m.sheen_color_texture), "sheen_color.png");
    EXPECT_EQ(name(m.sheen_roughness_texture), "sheen_roughness.png");
    EXPECT_EQ(name(m.diffuse_transmission_texture), "leaf.png");
    EXPECT_EQ(name(m.diffuse_transmission_color_texture), "leaf_color.png");
    EXPECT_EQ(name(m.anisotropy_texture), "anisotropy.png");
    EXPECT_EQ(name(m.iridescence_texture), "film.png");
    EXPECT_EQ(name(m.iridescence_thickness_texture), "thickness.png");
    EXPECT_EQ(m.normal_scale, 0.5f);
    EXPECT_EQ(m.clearcoat_normal_scale, 2);
    EXPECT_EQ(scene.images.size(), 17u) << "images that nothing uses are not loaded";
}

/// A file with three triangles, each with a material of its own, and the variants "day" and "night".
class GltfVariants : public GltfTest {
  protected:
    void SetUp() override {
        GltfTest::SetUp();
        for (int i = 0; i < 3; ++i) {
            Json& primitive = b.add_triangle();
            primitive["material"] = b.push("materials", {{"name", std::to_string(i)}});
        }
        b.json["extensions"][kName]["variants"] = {{{"name", "day"}}, {{"name", "night"}}};
        b.json["extensionsRequired"] = b.json["extensionsUsed"] = {kName};
        mappings(0) = {{{"material", 2}, {"variants", {0, 1}}}};
        mappings(1) = {{{"material", 0}, {"variants", Json::array()}}, {{"material", 2}, {"variants", {1}}}};
    }
    Json& mappings(std::size_t mesh) {
        return b.json["meshes"][mesh]["primitives"][0]["extensions"][kName]["mappings"];
    }
    /// Returns the names of the materials of all triangles.
    std::string materials(const std::string& variant) {
        const Scene scene = load_gltf(write("scene.glb", b.glb()), {.variant = variant});
        std::string names;
        for (const Mesh& mesh : scene.meshes)
            for (const std::uint32_t m : mesh.triangle_material) names += scene.materials[m].name;
        return names;
    }

    static constexpr const char* kName = "KHR_materials_variants";
    GltfBuilder b;
};

TEST_F(GltfVariants, ChooseMaterials) {
    EXPECT_EQ(materials(""), "012");
    EXPECT_EQ(materials("day"), "212");
    EXPECT_EQ(materials("night"), "222");
    const GltfScene scene(write("scene.glb", b.glb()));
    EXPECT_EQ(scene.variants(), (std::vector<std::string>{"day", "night"}));
}

TEST_F(GltfVariants, UnknownNamesAreRefusedWithTheNamesOfTheFile) {
    const auto message = [&] { return without_name(error_message([&] { materials("dusk"); })); };
    EXPECT_EQ(message(), "no material variant 'dusk': there are 'day', 'night'");
    b.json.erase("extensions");
    for (Json& mesh : b.json["meshes"]) mesh["primitives"][0].erase("extensions");
    EXPECT_EQ(message(), "has no material variants, so not 'dusk' either");
}

TEST_F(GltfVariants, DamagedMappingsAreRefused) {
    mappings(0)[0]["variants"][1] = 2;
    EXPECT_NE(refusal(b).find("mappings[0].variants[1]: 2 is not an index into variants, which has 2"),
              std::string::npos)
        << refusal(b);
    mappings(0)[0]["variants"][1] = 1;
    mappings(0)[0]["material"] = 3;
    EXPECT_NE(refusal(b).find("material: 3 is not an index into materials, which has 3"), std::string::npos)
        << refusal(b);
    mappings(0)[0]["material"] = 0;
    b.json["extensions"][kName]["variants"][0] = Json::object();
    EXPECT_EQ(refusal(b), "extensions.KHR_materials_variants.variants[0]: has no 'name'");
}

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

TEST_F(GltfMaterials, Samplers) {
    const int index = texture("t.png");
    material()["pbrMetallicRoughness"]["baseColorTexture"]["index"] = index;
    b.json["textures"][0]["sampler"] = b.push("samplers", {{"wrapS", 33071}, {"wrapT", 33648}, {"magFilter", 9728}});
    TextureRef t = load().materials.at(0).base_color_texture;
    EXPECT_EQ(t.wrap_u, Wrap::clamp_to_edge);
    EXPECT_EQ(t.wrap_v, Wrap::mirrored_repeat);
    EXPECT_TRUE(t.nearest);
    b.json["samplers"][0] = {{"minFilter", 9728}};
    t = load().materials.at(0).base_color_texture;
    EXPECT_EQ(t.wrap_u, Wrap::repeat);
    EXPECT_FALSE(t.nearest) << "only magnification counts";
}

TEST_F(GltfMaterials, TextureTransform) {
    Json& info = material()["pbrMetallicRoughness"]["baseColorTexture"];
    info = {{"index", texture("t.png")}};
    info["extensions"]["KHR_texture_transform"] = {
        {"offset", {0.5, -0.25}}, {"rotation", std::numbers::pi / 2}, {"scale", {2, 3}}, {"texCoord", 1}};
    b.json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_1"] = 1;
    const TextureRef t = load().materials.at(0).base_color_texture;
    EXPECT_EQ(t.uv_set, 1);
    // The transform scales, then rotates by 90 degrees from +v (down) to +u (right), then translates.
    const vec2 u = t.uv_transform * vec3(1, 0, 1), v = t.uv_transform * vec3(0, 1, 1);
    EXPECT_LT(glm::distance(u, vec2(0.5f, -2.25f)), 1e-6f);
    EXPECT_LT(glm::distance(v, vec2(3.5f, -0.25f)), 1e-6f);
    EXPECT_TRUE(load().report.warnings.empty());
}

TEST_F(GltfMaterials, TwoOfManyTextureCoordinates) {
    Json& attributes = b.json["meshes"][0]["primitives"][0]["attributes"];
    attributes["TEXCOORD_4"] = b.floats("VEC2", {4, 4, 4, 4, 4, 4});
    attributes["TEXCOORD_7"] = b.floats("VEC2", {7, 7, 7, 7, 7, 7});
    material() = {{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", texture("a.png")}, {"texCoord", 7}}}}},
                  {"emissiveTexture", {{"index", 0}, {"texCoord", 4}}}};
    Scene scene = load();
    EXPECT_EQ(scene.materials[0].base_color_texture.uv_set, 0);
    EXPECT_EQ(scene.materials[0].emission_texture.uv_set, 1);
    EXPECT_EQ(scene.meshes.at(0).uvs[0][0], vec2(7));
    EXPECT_EQ(scene.meshes[0].uvs[1][0], vec2(4));
    EXPECT_TRUE(scene.report.warnings.empty());
    material()["pbrMetallicRoughness"]["metallicRoughnessTexture"] = {{"index", 0}};
    scene = load();
    ASSERT_EQ(scene.report.warnings.size(), 1u);
    EXPECT_NE(scene.report.warnings[0].find("more than two sets"), std::string::npos);
}

TEST_F(GltfMaterials, MissingTextureCoordinatesAreReported) {
    material() = {{"emissiveTexture", {{"index", texture("a.png")}, {"texCoord", 1}}}};
    const Scene scene = load();
    ASSERT_EQ(scene.report.warnings.size(), 1u);
    EXPECT_EQ(scene.report.warnings[0],
              "meshes[0].primitives[0]: has no TEXCOORD_1, which its material's textures need");
}

TEST_F(GltfMaterials, TangentsAreMadeForNormalMaps) {
    EXPECT_TRUE(load().meshes.at(0).tangents.empty());
    material()["normalTexture"]["index"] = texture("n.png");
    Scene scene = load();
    EXPECT_EQ(scene.meshes.at(0).tangents, std::vector<vec4>(3, vec4(1, 0, 0, 1)));
    EXPECT_EQ(scene.report.tangents_generated, 3u);

    // A transform that rotates the texture rotates its tangents.
    material()["normalTexture"]["extensions"]["KHR_texture_transform"]["rotation"] = std::numbers::pi;
    EXPECT_LT(glm::distance(load().meshes.at(0).tangents[0], vec4(-1, 0, 0, 1)), 1e-6f);

    // The file's tangents are used if they are valid and there are normals.
    Json& attributes = b.json["meshes"][0]["primitives"][0]["attributes"];
    attributes["NORMAL"] = b.floats("VEC3", {0, 0, 1, 0, 0, 1, 0, 0, 1});
    attributes["TANGENT"] = b.floats("VEC4", {0, 2, 0, -1, 0, 2, 0, -1, 0, 2, 0, -1});
    scene = load();
    EXPECT_EQ(scene.meshes.at(0).tangents, std::vector<vec4>(3, vec4(0, 1, 0, -1)));
    EXPECT_EQ(scene.report.tangents_generated, 0u);
    attributes["TANGENT"] = b.floats("VEC4", {0, 2, 0, -1, 0, 2, 0, -1, 0, 0, 0, -1});
    EXPECT_EQ(load().report.tangents_generated, 3u);

    material().erase("normalTexture");
    EXPECT_TRUE(load().meshes.at(0).tangents.empty());
    extension("KHR_materials_clearcoat")["clearcoatNormalTexture"]["index"] = 0;
    EXPECT_EQ(load().report.tangents_generated, 3u);
}

TEST_F(GltfMaterials, TangentsAreMadeForAnisotropy) {
    extension("KHR_materials_anisotropy")["anisotropyStrength"] = 0.5;
    EXPECT_EQ(load().meshes.at(0).tangents, std::vector<vec4>(3, vec4(1, 0, 0, 1)));

    // Tangents follow the texture of the anisotropy, and the normal map if there is one.
    extension("KHR_materials_anisotropy")["anisotropyTexture"] = {
        {"index", texture("a.png")}, {"extensions", {{"KHR_texture_transform", {{"rotation", std::numbers::pi}}}}}};
    EXPECT_LT(glm::distance(load().meshes.at(0).tangents[0], vec4(-1, 0, 0, 1)), 1e-6f);
    material()["normalTexture"]["index"] = texture("n.png");
    EXPECT_LT(glm::distance(load().meshes.at(0).tangents[0], vec4(1, 0, 0, 1)), 1e-6f);

    // Animations may raise a strength of 0.
    material().erase("normalTexture");
    extension("KHR_materials_anisotropy") = Json::object();
    EXPECT_EQ(load().meshes.at(0).tangents.size(), 3u);

    b.json["meshes"][0]["primitives"][0]["attributes"].erase("TEXCOORD_0");
    EXPECT_TRUE(load().report.warnings.empty());
    extension("KHR_materials_anisotropy")["anisotropyStrength"] = 0.5;
    const Scene bare = load();
    EXPECT_TRUE(bare.meshes.at(0).tangents.empty());
    EXPECT_EQ(
        bare.report.warnings,
        std::vector<std::string>{"meshes[0].primitives[0]: has neither tangents nor texture coordinates, which its "
                                 "anisotropy needs"});
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

using GltfSky = GltfTest;
using GltfLight = GltfTest;
using GltfCamera = GltfTest;

TEST_F(GltfSky, InsideTheFile) {
    GltfBuilder b;
    EXPECT_TRUE(load(b).environment.black());
    b.json["extensionsUsed"] = {"HALFLIGHT_environment"};
    b.json["extensions"]["HALFLIGHT_environment"]["color"] = {0.5, 1, 2};
    const Scene scene = load(b);
    EXPECT_EQ(scene.environment.color, vec3(0.5f, 1, 2));
    EXPECT_TRUE(scene.environment.map.pixels.empty() && scene.report.warnings.empty());
    b.json["extensions"]["HALFLIGHT_environment"]["color"] = {0.5, -1, 2};
    EXPECT_EQ(refusal(b), "extensions.HALFLIGHT_environment: color is negative or not finite");
    b.json["extensions"]["HALFLIGHT_environment"]["color"] = {0.5, 1e200, 2};
    EXPECT_EQ(refusal(b), "extensions.HALFLIGHT_environment: color is negative or not finite");
    b.json["extensions"]["HALFLIGHT_environment"].erase("color");
    EXPECT_NE(refusal(b), "");
}

TEST_F(GltfLight, OfEveryType) {
    GltfBuilder b;
    b.json["extensionsUsed"] = b.json["extensionsRequired"] = {"KHR_lights_punctual"};
    b.json["extensions"]["KHR_lights_punctual"]["lights"] = {
        {{"type", "point"}, {"name", "lamp"}, {"color", {1, 0.5, 0}}, {"intensity", 20}, {"range", 3}},
        {{"type", "spot"}, {"spot", {{"innerConeAngle", 0.25}, {"outerConeAngle", 0.5}}}},
        {{"type", "directional"}, {"intensity", 100000}},
        {{"type", "spot"}, {"spot", {{"innerConeAngle", 0.75}, {"outerConeAngle", 0.5}}}},
    };
    const auto node = [&](int light, Json extra) {
        extra["extensions"]["KHR_lights_punctual"]["light"] = light;
        b.push("nodes", extra);
    };
    node(0, {{"translation", {1e6, 2, 3}}});
    node(1, {{"name", "stage"}, {"scale", {5, 5, 5}}});
    const double half = std::sqrt(0.5);
    node(2, {{"rotation", {-half, 0, 0, half}}});  // a rotation of -Z to -Y
    node(3, Json::object());
    const Scene scene = load(b);
    ASSERT_EQ(scene.lights.size(), 4u);
    EXPECT_EQ(scene.lights[0].type, LightType::point);
    EXPECT_EQ(scene.lights[0].name, "lamp");
    EXPECT_EQ(scene.lights[0].intensity, vec3(20, 10, 0));
    EXPECT_EQ(scene.lights[0].position, dvec3(1e6, 2, 3));
    EXPECT_EQ(scene.lights[1].type, LightType::spot);
    EXPECT_EQ(scene.lights[1].name, "stage");
    EXPECT_EQ(scene.lights[1].inner_cone, 0.25f);
    EXPECT_EQ(scene.lights[1].outer_cone, 0.5f);
    EXPECT_EQ(scene.lights[1].direction, vec3(0, 0, -1));
    EXPECT_EQ(scene.lights[2].type, LightType::directional);
    EXPECT_EQ(scene.lights[2].intensity, vec3(100000));
    EXPECT_LT(glm::distance(scene.lights[2].direction, vec3(0, -1, 0)), 1e-6f);
    EXPECT_LT(scene.lights[3].inner_cone, scene.lights[3].outer_cone);
    EXPECT_EQ(scene.report.warnings.size(), 1u);
}

TEST_F(GltfLight, UnknownOrMissingOnesAreRefused) {
    GltfBuilder b;
    b.push("nodes", {{"extensions", {{"KHR_lights_punctual", {{"light", 1}}}}}});
    b.json["extensions"]["KHR_lights_punctual"]["lights"] = {{{"type", "sphere"}}};
    EXPECT_EQ(refusal(b), "nodes[0].extensions.KHR_lights_punctual.light: 1 is not an index into lights, which has 1");
    b.json["nodes"][0]["extensions"]["KHR_lights_punctual"]["light"] = 0;
    EXPECT_EQ(refusal(b), "extensions.KHR_lights_punctual.lights[0]: light type 'sphere' is unknown");
}

TEST_F(GltfCamera, PerspectiveAndOrthographic) {
    GltfBuilder b;
    b.json["cameras"] = {
        {{"type", "perspective"},
         {"name", "main"},
         {"perspective", {{"yfov", 0.75}, {"znear", 0.5}, {"aspectRatio", 2}}}},
        {{"type", "orthographic"}, {"orthographic", {{"xmag", 8}, {"ymag", -4}, {"znear", 0}, {"zfar", 100}}}}};
    b.push("nodes", {{"camera", 0}, {"scale", {3, -2, 5}}, {"translation", {1, 2, 3}}});
    b.push("nodes", {{"camera", 1}, {"name", "plan"}});
    b.push("nodes", {{"camera", 0}, {"name", "copy"}});
    const Scene scene = load(b);
    ASSERT_EQ(scene.cameras.size(), 3u);
    const Camera& p = scene.cameras[0];
    EXPECT_EQ(p.name, "main");
    EXPECT_FALSE(p.orthographic);
    EXPECT_EQ(p.vertical_fov, 0.75);
    EXPECT_EQ(p.aspect, 2);
    EXPECT_EQ(p.near_plane, 0.5);
    EXPECT_EQ(p.far_plane, 0);
    // Scale does not affect the camera. Its basis stays right-handed, so mirroring y rotates it about its own axis.
    EXPECT_EQ(p.camera_to_world, dmat4(dvec4(-1, 0, 0, 0), dvec4(0, -1, 0, 0), dvec4(0, 0, 1, 0), dvec4(1, 2, 3, 1)));
    const Camera& o = scene.cameras[1];
    EXPECT_EQ(o.name, "plan");
    EXPECT_TRUE(o.orthographic);
    EXPECT_EQ(o.ortho_height, 8);
    EXPECT_EQ(o.aspect, 2);
    EXPECT_EQ(o.far_plane, 100);
    EXPECT_EQ(scene.cameras[2].name, "copy") << "a second use of a camera goes by its node's name";
}

TEST_F(GltfCamera, WithoutViewIsRefused) {
    GltfBuilder b;
    b.push("nodes", {{"camera", 0}});
    b.json["cameras"] = {{{"type", "perspective"}, {"perspective", {{"yfov", 0}, {"znear", 1}}}}};
    EXPECT_EQ(refusal(b), "cameras[0]: yfov 0 is not between 0 and pi");
    b.json["cameras"][0]["perspective"].erase("yfov");
    EXPECT_EQ(refusal(b), "cameras[0].perspective: has no 'yfov'");
}

}  // namespace
}  // namespace halflight
