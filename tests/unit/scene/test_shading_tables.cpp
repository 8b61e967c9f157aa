// Tests shading tables: needs, defines, materials, textures, vertex rows.
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <glm/gtc/matrix_transform.hpp>
#include <glm/gtc/packing.hpp>
#include <map>
#include <set>

#include "engine/scene/light_types.h"
#include "engine/scene/material_properties.h"
#include "engine/tables/light_textures.h"
#include "engine/tables/shading_tables.h"
#include "shaders/shared/light.h"
#include "shaders/shared/material_rows.h"
#include "shaders/shared/texture_rows.h"
#include "shaders/shared/vertex.h"
#include "shaders/shared/word.h"
#include "tests/support/texels.h"

namespace halflight {
namespace {

/// Returns a triangle in the plane x + y + z = 1 with all vertex attributes; its material is black and diffuse unless a
/// test changes it.
Scene plain_scene() {
    Scene scene;
    scene.name = "plain";
    Material& material = scene.materials.emplace_back();
    material.metallic = material.specular = 0;
    Mesh& mesh = scene.meshes.emplace_back();
    mesh.positions = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    mesh.normals.assign(3, glm::normalize(vec3(1)));
    mesh.tangents.assign(3, vec4(glm::normalize(vec3(-1, 1, 0)), 1));
    mesh.uvs[0] = {{0, 0}, {1, 0}, {0, 1}};
    mesh.triangles = {{0, 1, 2}};
    mesh.triangle_material = {0};
    scene.instances.emplace_back().mesh = 0;
    return scene;
}

/// Expects that the needs alone are those of the tables.
ShadingTables tables_of(const Scene& scene) {
    const TraceTables trace = build_trace_tables(scene);
    ShadingTables tables = build_shading_tables(scene, trace);
    EXPECT_EQ(shader_defines(shading_needs(scene, trace, LightChoice::automatic, SunChoice::among)),
              shader_defines(tables.needs));
    return tables;
}

TEST(ShadingTables, DiffuseSceneNeedsDiffuseOnly) {
    const ShadingTables tables = tables_of(plain_scene());
    EXPECT_EQ(shader_defines(tables.needs),
              (std::vector<std::pair<std::string, std::string>>{{"HALFLIGHT_DIFFUSE", "1"},
                                                                {"HALFLIGHT_LAYER_ROWS", "2"},
                                                                {"HALFLIGHT_ONE_SIDED", "1"},
                                                                {"HALFLIGHT_SURFACE_ROWS", "5"},
                                                                {"HALFLIGHT_VERTEX_STRIDE", "1"}}));
    EXPECT_TRUE(tables.textures.empty() && tables.color_texels.empty() && tables.data_texels.empty());
    EXPECT_TRUE(tables.lights.empty() && tables.environment.pixels.empty() && tables.albedo.pixels.empty());
    EXPECT_EQ(tables.vertices.size(), 3u);
    EXPECT_EQ(tables.materials.size(), std::size_t(material_rows()));
}

TEST(ShadingTables, NeedsFollowMaterials) {
    const auto needs = [](auto&& change) {
        Scene scene = plain_scene();
        change(scene.materials[0]);
        return tables_of(scene).needs;
    };
    EXPECT_TRUE(needs([](Material& m) { m.specular = 0.5f; }).glossy);
    EXPECT_TRUE(needs([](Material& m) { m.metallic = 0.5f; }).glossy);
    EXPECT_FALSE(needs([](Material& m) { m.metallic = 1; }).diffuse);
    EXPECT_TRUE(needs([](Material& m) { m.transmission = 0.5f; }).transmission);
    EXPECT_FALSE(needs([](Material& m) { m.transmission = 1; }).diffuse);
    EXPECT_FALSE(needs([](Material& m) { m.base_color = vec4(0, 0, 0, 1); }).diffuse);
    const SceneNeeds leaf = needs([](Material& m) { m.diffuse_transmission = 0.5f, m.base_color = vec4(0, 0, 0, 1); });
    EXPECT_TRUE(leaf.diffuse_transmission && leaf.diffuse) << "the colour is its own";
    EXPECT_FALSE(leaf.glossy || leaf.transmission || leaf.volume);
    EXPECT_TRUE(needs([](Material& m) { m.diffuse_transmission = m.thickness = 0.5f; }).volume) << "a candle";
    EXPECT_FALSE(needs([](Material& m) { m.thickness = 1; }).volume);
    const SceneNeeds hidden = needs([](Material& m) { m.diffuse_transmission = m.transmission = 1; });
    EXPECT_FALSE(hidden.diffuse_transmission || hidden.diffuse);
    EXPECT_TRUE(needs([](Material& m) { m.clearcoat = 1; }).clearcoat);
    EXPECT_FALSE(needs([](Material& m) { m.specular_color = vec3(0.5f); }).specular_color) << "nothing is specular";
    EXPECT_TRUE(needs([](Material& m) { m.specular = 1, m.specular_color = vec3(0.5f); }).specular_color);
    const SceneNeeds unlit = needs([](Material& m) { m.unlit = true, m.emission = vec3(7); });
    EXPECT_TRUE(unlit.unlit && unlit.emission);
    EXPECT_FALSE(unlit.diffuse || unlit.glossy || unlit.lights());
    const SceneNeeds glowing = needs([](Material& m) { m.emission = vec3(7); });
    EXPECT_TRUE(glowing.emission && glowing.area_lights);
    std::set<std::string> defines;
    for (const auto& [name, value] : shader_defines(glowing)) defines.insert(name);
    EXPECT_TRUE(defines.contains("HALFLIGHT_LIGHTS") && defines.contains("HALFLIGHT_AREA_LIGHTS"));
}

TEST(ShadingTables, RowsOfLobesDoNotOverlap) {
    SceneNeeds needs;
    for (const MaterialLobe& lobe : material_lobes()) needs.*lobe.need = lobe.record_rows > 0;
    std::map<std::string, std::string> defines;
    for (const auto& [name, value] : shader_defines(needs)) defines[name] = value;
    const auto check = [&](const char* suffix, int MaterialLobe::*rows, int first, int end) {
        std::set<int> used;
        for (const MaterialLobe& lobe : material_lobes())
            for (int i = 0; i < lobe.*rows; ++i)
                EXPECT_TRUE(
                    used.insert(std::stoi(defines.at("HALFLIGHT_" + (lobe.define + std::string(suffix)))) + i).second)
                    << lobe.define;
        EXPECT_EQ(std::pair(*used.begin(), *used.rbegin()), std::pair(first, end - 1)) << suffix;
    };
    check("_ROW", &MaterialLobe::record_rows, 3, std::stoi(defines.at("HALFLIGHT_SURFACE_ROWS")) - 2);
    check("_LAYER", &MaterialLobe::layer_rows, 2, std::stoi(defines.at("HALFLIGHT_LAYER_ROWS")));
}

TEST(ShadingTables, UnusedMaterialsHaveNoNeeds) {
    Scene scene = plain_scene();
    Material unused;
    unused.clearcoat = unused.transmission = 1;
    unused.base_color_texture.image = 0;
    scene.images.push_back({"", 1, 1, {1, 2, 3, 4}});
    scene.materials.push_back(unused);
    const ShadingTables tables = tables_of(scene);
    EXPECT_FALSE(tables.needs.clearcoat || tables.needs.transmission || tables.needs.texture_coordinates);
    EXPECT_EQ(tables.materials.size(), 2u * static_cast<std::size_t>(material_rows()));
}

TEST(ShadingTables, TexturesAreStoredOncePerUse) {
    Scene scene = plain_scene();
    scene.images.push_back({"a", 2, 1, {0, 128, 255, 255, 1, 2, 3, 4}});
    scene.images.push_back({"b", 1, 1, {9, 8, 7, 6}});
    Material& m = scene.materials[0];
    m.metallic = m.specular = 1;
    m.base_color_texture.image = 0;
    m.emission = vec3(1);
    m.emission_texture = m.base_color_texture;          // equals an earlier descriptor
    m.normal_texture.image = 0;                         // the image exists, but holds data here
    m.metallic_roughness_texture.image = 1;             //
    m.specular_texture = m.metallic_roughness_texture;  //
    m.specular_texture.wrap_v = Wrap::mirrored_repeat;  // the texels exist, with another descriptor
    m.specular_texture.uv_set = 1;
    m.specular_texture.uv_transform[2] = vec2(0.5f, 0.25f);
    const ShadingTables tables = tables_of(scene);
    EXPECT_EQ(tables.color_texels.size(), 2u);
    EXPECT_EQ(tables.data_texels.size(), 3u);
    EXPECT_EQ(tables.textures.size(), 4u * shared::kTextureStride);
    EXPECT_TRUE(tables.needs.texture_transforms);
    const vec4* row = tables.materials.data();
    EXPECT_EQ(shared::word_of_float(row[5].y), shared::word_of_float(row[6].x));
    EXPECT_EQ(shared::word_of_float(row[7].x), shared::kNoTexture);
    const uvec4* specular = &tables.textures[shared::word_of_float(row[6].y) * shared::kTextureStride];
    EXPECT_EQ(texels_of(tables.data_texels)[specular[0].x], (std::array<std::uint8_t, 4>{9, 8, 7, 6}));
    EXPECT_EQ(uvec2(specular[0].y, specular[0].z), uvec2(1, 1));
    EXPECT_EQ(specular[0].w, (shared::kWrapMirroredRepeat << shared::kTextureWrapVShift) | shared::kTextureUvSet1);
    EXPECT_EQ(std::bit_cast<float>(specular[1].z), 0.5f);
    EXPECT_EQ(std::bit_cast<float>(specular[2].z), 0.25f);
    EXPECT_EQ(std::bit_cast<float>(specular[2].y), 1.0f);
}

TEST(ShadingTables, ColourTexelsAreLinearHalves) {
    Scene scene = plain_scene();
    TextureImage ramp{"ramp", 256, 1, {}};
    for (int i = 0; i < 256; ++i) {
        const auto v = static_cast<std::uint8_t>(i);
        ramp.rgba.edit().insert(ramp.rgba.edit().end(), {v, v, v, v});
    }
    scene.images = {ramp};
    scene.materials[0].base_color_texture.image = 0;
    const auto texels = texels_of(tables_of(scene).color_texels);
    for (std::size_t i = 0; i < 256; ++i) {
        const double expected = srgb_to_linear(static_cast<std::uint8_t>(i));
        const float red = glm::unpackHalf1x16(texels[i][0]);
        // The tolerance is half a unit in the last of 11 bits. No sRGB value except 0 is below the normal halves.
        EXPECT_NEAR(red, expected, expected * 0x1p-11) << i;
        EXPECT_NEAR(glm::unpackHalf1x16(texels[i][3]), double(i) / 255, double(i) / 255 * 0x1p-11) << i;
    }
    EXPECT_EQ(texels[0][0], 0);
    EXPECT_EQ(glm::unpackHalf1x16(texels[255][0]), 1.0f);
}

TEST(ShadingTables, NormalsAndTangentsOfMergedMeshesAreInWorldSpace) {
    Scene scene = plain_scene();
    scene.images.push_back({"n", 1, 1, {128, 128, 255, 255}});
    scene.materials[0].normal_texture.image = 0;
    scene.meshes[0].colors.assign(3, vec4(0.1f, 0.2f, 0.3f, 0.4f));
    // The first transform mirrors, and the second one scales non-uniformly.
    scene.instances[0].object_to_world = glm::scale(glm::rotate(dmat4(1), 0.7, dvec3(1, 2, 3)), dvec3(-2, 1, 0.1));
    const TraceTables trace = build_trace_tables(scene);
    const ShadingTables tables = build_shading_tables(scene, trace);
    ASSERT_EQ(tables.needs.vertex_stride(), 4);
    const dmat3 m(scene.instances[0].object_to_world);
    const dvec3 normal = glm::normalize(glm::transpose(glm::inverse(m)) * dvec3(scene.meshes[0].normals[0]));
    const dvec3 tangent = glm::normalize(m * dvec3(scene.meshes[0].tangents[0]));
    for (std::size_t i = 0; i < 3; ++i) {
        const vec4* row = &tables.vertices[4 * i];
        EXPECT_NEAR(glm::dot(glm::normalize(dvec3(row[0])), normal), 1, 1e-12);
        EXPECT_NEAR(glm::dot(glm::normalize(dvec3(row[2])), tangent), 1, 1e-12);
        EXPECT_EQ(row[0].w, scene.meshes[0].uvs[0][i].x);
        EXPECT_EQ(row[1], vec4(scene.meshes[0].uvs[0][i].y, 0, 0, -1));
        EXPECT_EQ(row[3], scene.meshes[0].colors[i]);
    }
    Scene flat = plain_scene();
    flat.meshes[0].normals.assign(3, vec3(0, 0, 1));
    flat.instances[0].object_to_world = glm::scale(dmat4(1), dvec3(1, 1, 0));
    for (const vec4& row : tables_of(flat).vertices) EXPECT_EQ(vec3(row), vec3(0, 0, 1));
}

TEST(ShadingTables, EveryLightTypeHasARow) {
    int type = 0;
    for (const LightTypeRow& row : light_types()) {
        SCOPED_TRACE(row.name);
        EXPECT_EQ(row.type, static_cast<LightType>(type++));
        EXPECT_EQ(&row_of(row.type), &row);
        EXPECT_EQ(find_light_type(row.name), &row);
        Scene scene = plain_scene();
        scene.lights.emplace_back().type = row.type;
        const ShadingTables tables = tables_of(scene);
        EXPECT_EQ(shared::light_kind(shared::word_of_float(tables.lights.at(0).w)), row.kind);
        for (const LightTypeRow& other : light_types()) {
            if (other.need) {
                EXPECT_EQ(tables.needs.*other.need, &other == &row) << other.name;
            }
        }
    }
    EXPECT_EQ(find_light_type("sphere"), nullptr);
}

TEST(ShadingTables, AlphaCutoffCarriesTheMode) {
    Scene scene = plain_scene();
    scene.materials[0].base_color.a = 0.3f;
    EXPECT_EQ(tables_of(scene).materials[5].x, 0.0f);
    scene.materials[0].alpha_mode = AlphaMode::mask;
    EXPECT_EQ(tables_of(scene).materials[5].x, 0.5f);
    scene.materials[0].alpha_mode = AlphaMode::blend;
    const ShadingTables blended = tables_of(scene);
    EXPECT_EQ(blended.materials[5].x, shared::kAlphaBlend);
    EXPECT_TRUE(blended.needs.alpha);
}

}  // namespace
}  // namespace halflight
