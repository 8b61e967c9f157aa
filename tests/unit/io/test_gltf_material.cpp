// Tests materials of glTF files: properties, texture references and variants.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/scene/material_properties.h"
#include "tests/unit/io/gltf_materials.h"

namespace halflight {
namespace {

/// tests/unit/scene/test_material_properties.cpp reads every property and texture.
TEST_F(GltfMaterials, NamesModesAndUsedTexturesAreRead) {
    EXPECT_EQ(load().materials.at(0).alpha_mode, AlphaMode::opaque);
    material().update({{"name", "leaf"}, {"alphaMode", "MASK"}});
    material()["occlusionTexture"]["index"] = texture("unused.png");
    material()["emissiveTexture"]["index"] = texture("used.png");
    Scene scene = load();
    EXPECT_EQ(scene.materials.at(0).name, "leaf");
    EXPECT_EQ(scene.materials[0].alpha_mode, AlphaMode::mask);
    ASSERT_EQ(scene.images.size(), 1u) << "images that nothing uses are not loaded";
    EXPECT_EQ(scene.images[0].name, "used.png");
    material()["alphaMode"] = "BLEND";
    EXPECT_EQ(load().materials.at(0).alpha_mode, AlphaMode::blend);
    material()["alphaMode"] = "GLASS";
    scene = load();
    EXPECT_EQ(scene.materials.at(0).alpha_mode, AlphaMode::opaque);
    EXPECT_EQ(scene.report.warnings.size(), 1u);
}

TEST_F(GltfMaterials, EmissionHasAStrengthAndNoEffectOnUnlitMaterials) {
    EXPECT_EQ(load().materials.at(0).emission, vec3(0));
    material()["emissiveFactor"] = {1, 0.5, 0};
    extension("KHR_materials_emissive_strength") = {{"emissiveStrength", 3000000000}};
    EXPECT_EQ(load().materials.at(0).emission, vec3(3e9f, 1.5e9f, 0));
    extension("KHR_materials_unlit") = Json::object();
    const Material m = load().materials.at(0);
    EXPECT_TRUE(m.unlit);
    EXPECT_EQ(m.emission, vec3(0));
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

/// A file with three triangles, each with a material of its own, and the variants "day" and "night".
TEST_F(GltfMaterials, VariantsChooseMaterials) {
    const char* const name = "KHR_materials_variants";
    GltfBuilder file;
    for (int i = 0; i < 3; ++i) {
        Json& primitive = file.add_triangle();
        primitive["material"] = file.push("materials", {{"name", std::to_string(i)}});
    }
    file.json["extensions"][name]["variants"] = {{{"name", "day"}}, {{"name", "night"}}};
    file.require({name});
    file.primitive(0)["extensions"][name]["mappings"] = {{{"material", 2}, {"variants", {0, 1}}}};
    file.primitive(1)["extensions"][name]["mappings"] = {{{"material", 0}, {"variants", Json::array()}},
                                                         {{"material", 2}, {"variants", {1}}}};
    const auto materials = [&](const std::string& variant) {
        const Scene scene = GltfTest::load(file, {.variant = variant});
        std::string names;
        for (const Mesh& mesh : scene.meshes)
            for (const std::uint32_t m : mesh.triangle_material) names += scene.materials[m].name;
        return names;
    };
    EXPECT_EQ(materials(""), "012");
    EXPECT_EQ(materials("day"), "212");
    EXPECT_EQ(materials("night"), "222");
    EXPECT_EQ(open(file).variants(), (std::vector<std::string>{"day", "night"}));
    const auto message = [&] { return without_name(error_message([&] { materials("dusk"); })); };
    EXPECT_EQ(message(), "no material variant 'dusk': there are 'day', 'night'");
    const std::string mapping = "/meshes/0/primitives/0/extensions/KHR_materials_variants/mappings/0";
    const std::string element = "meshes[0].primitives[0].extensions.KHR_materials_variants.mappings[0].";
    for (const auto& [pointer, value, warning] :
         {Refusal{mapping + "/variants/1", 2, element + "variants[1]: "},
          Refusal{mapping + "/material", 3, element + "material: "},
          Refusal{"/extensions/KHR_materials_variants/variants/0", Json::object(),
                  "extensions.KHR_materials_variants.variants[0]: "}}) {
        GltfBuilder damaged = file;
        damaged.put(pointer, value);
        expect_warnings(GltfTest::load(damaged).report.warnings, {warning});
    }
    file.json.erase("extensions");
    for (Json& mesh : file.json["meshes"]) mesh["primitives"][0].erase("extensions");
    EXPECT_EQ(message(), "has no material variants, so not 'dusk' either");
}

TEST_F(GltfMaterials, Samplers) {
    material()["emissiveTexture"]["index"] = texture("t.png");
    b.json["textures"][0]["sampler"] = b.push("samplers", {{"wrapS", 33071}, {"wrapT", 33648}, {"magFilter", 9728}});
    TextureRef t = load().materials.at(0).emission_texture;
    EXPECT_EQ(t.wrap_u, Wrap::clamp_to_edge);
    EXPECT_EQ(t.wrap_v, Wrap::mirrored_repeat);
    EXPECT_TRUE(t.nearest);
    b.json["samplers"][0] = {{"minFilter", 9728}};
    t = load().materials.at(0).emission_texture;
    EXPECT_EQ(t.wrap_u, Wrap::repeat);
    EXPECT_FALSE(t.nearest) << "only magnification counts";
}

TEST_F(GltfMaterials, TextureTransform) {
    Json& info = material()["pbrMetallicRoughness"]["baseColorTexture"];
    info = {{"index", texture("t.png")}};
    info["extensions"]["KHR_texture_transform"] = {
        {"offset", {0.5, -0.25}}, {"rotation", std::numbers::pi / 2}, {"scale", {2, 3}}, {"texCoord", 1}};
    b.attributes()["TEXCOORD_1"] = 1;
    const TextureRef t = load().materials.at(0).base_color_texture;
    EXPECT_EQ(t.uv_set, 1);
    // The transform scales, then rotates by 90 degrees from +v (down) to +u (right), then translates.
    const vec2 u = t.uv_transform * vec3(1, 0, 1), v = t.uv_transform * vec3(0, 1, 1);
    EXPECT_LT(glm::distance(u, vec2(0.5f, -2.25f)), 1e-6f);
    EXPECT_LT(glm::distance(v, vec2(3.5f, -0.25f)), 1e-6f);
    EXPECT_TRUE(load().report.warnings.empty());
}

TEST_F(GltfMaterials, TwoOfManyTextureCoordinates) {
    b.attributes()["TEXCOORD_4"] = b.floats("VEC2", {4, 4, 4, 4, 4, 4});
    b.attributes()["TEXCOORD_7"] = b.floats("VEC2", {7, 7, 7, 7, 7, 7});
    material() = {{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", texture("a.png")}, {"texCoord", 7}}}}},
                  {"emissiveTexture", {{"index", 0}, {"texCoord", 4}}}};
    const Scene scene = load();
    EXPECT_EQ(scene.materials[0].base_color_texture.uv_set, 0);
    EXPECT_EQ(scene.materials[0].emission_texture.uv_set, 1);
    EXPECT_EQ(scene.meshes.at(0).uvs[0][0], vec2(7));
    EXPECT_EQ(scene.meshes[0].uvs[1][0], vec2(4));
    EXPECT_TRUE(scene.report.warnings.empty());
    material()["pbrMetallicRoughness"]["metallicRoughnessTexture"] = {{"index", 0}};
    expect_warnings(load().report.warnings, {"materials[0]: uses more than two sets"});
    material() = {{"emissiveTexture", {{"index", 0}, {"texCoord", 1}}}};
    expect_warnings(load().report.warnings, {"meshes[0].primitives[0]: has no TEXCOORD_1"});
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
    b.attributes()["NORMAL"] = b.floats("VEC3", {0, 0, 1, 0, 0, 1, 0, 0, 1});
    b.attributes()["TANGENT"] = b.floats("VEC4", {0, 2, 0, -1, 0, 2, 0, -1, 0, 2, 0, -1});
    scene = load();
    EXPECT_EQ(scene.meshes.at(0).tangents, std::vector<vec4>(3, vec4(0, 1, 0, -1)));
    EXPECT_EQ(scene.report.tangents_generated, 0u);
    b.attributes()["TANGENT"] = b.floats("VEC4", {0, 2, 0, -1, 0, 2, 0, -1, 0, 0, 0, -1});
    EXPECT_EQ(load().report.tangents_generated, 3u);

    material().erase("normalTexture");
    EXPECT_TRUE(load().meshes.at(0).tangents.empty());
    extension("KHR_materials_clearcoat")["clearcoatNormalTexture"]["index"] = 0;
    EXPECT_EQ(load().report.tangents_generated, 3u);
}

/// Tangents of an anisotropy without a texture follow TEXCOORD_0, whichever sets textures use.
TEST_F(GltfMaterials, TangentsFollowTheirOwnCoordinates) {
    for (const char* set : {"TEXCOORD_1", "TEXCOORD_2", "TEXCOORD_3"})
        b.attributes()[set] = b.floats("VEC2", {0, 0, 0, 1, 1, 0});
    texture("t.png");
    const auto along = [&](const vec4& tangent) {
        const Scene scene = load();
        EXPECT_EQ(scene.meshes.at(0).tangents, std::vector<vec4>(3, tangent));
        EXPECT_TRUE(scene.report.warnings.empty());
    };
    const std::pair<int, int> cases[] = {{0, 1}, {1, 1}, {0, 2}, {2, 0}, {2, 2}, {1, 2}, {2, 1}, {3, 2}};
    for (const auto& [color, glow] : cases) {
        SCOPED_TRACE(fmt::format("textures with sets {} and {}", color, glow));
        material() = {{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}, {"texCoord", color}}}}},
                      {"emissiveTexture", {{"index", 0}, {"texCoord", glow}}},
                      {"extensions", {{"KHR_materials_anisotropy", {{"anisotropyStrength", 0.5}}}}}};
        const vec4 of_first(1, 0, 0, 1), of_others(0, 1, 0, 1);
        along(of_first);
        Json info = {{"index", 0}, {"texCoord", glow}};
        extension("KHR_materials_anisotropy")["anisotropyTexture"] = info;
        along(glow == 0 ? of_first : of_others);
        info = {{"index", 0}, {"extensions", {{"KHR_texture_transform", {{"texCoord", color}}}}}};
        extension("KHR_materials_clearcoat")["clearcoatNormalTexture"] = info;
        along(color == 0 ? of_first : of_others);
        info["extensions"]["KHR_texture_transform"]["texCoord"] = glow;
        material()["normalTexture"] = info;
        along(glow == 0 ? of_first : of_others);
    }
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

    b.attributes().erase("TEXCOORD_0");
    EXPECT_TRUE(load().report.warnings.empty());
    extension("KHR_materials_anisotropy")["anisotropyStrength"] = 0.5;
    const Scene bare = load();
    EXPECT_TRUE(bare.meshes.at(0).tangents.empty());
    expect_warnings(bare.report.warnings, {"meshes[0].primitives[0]: "});
}

}  // namespace
}  // namespace halflight
