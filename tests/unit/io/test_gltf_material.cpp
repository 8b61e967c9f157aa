// Tests materials of glTF files: properties, texture references and variants.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/scene/material_properties.h"
#include "tests/unit/io/gltf_materials.h"

namespace halflight {
namespace {

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
    extension("KHR_materials_dispersion") = {{"dispersion", 1}};
    const Material m = load().materials.at(0);
    EXPECT_EQ((m.ior - 1) / (m.ior + 1), 1);
    EXPECT_EQ(m.specular_color, vec3(1));
    const auto dispersion =
        std::ranges::find(material_properties(), MaterialField(&Material::dispersion), &MaterialProperty::field);
    EXPECT_EQ(packed_value(m, *dispersion), vec4(0)) << "it has no colours";
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

}  // namespace
}  // namespace halflight
