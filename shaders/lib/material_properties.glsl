// tests/unit/scene/test_material_properties.cpp writes this file from the table of engine/scene/material_properties.h.
// After a change of the table, this command writes it anew: HALFLIGHT_REWRITE=1 ctest --preset release -R material_properties
//
// Unpacks the rows of materials (kUnitMaterials, RGBA32F), kMaterialStride texels for each of Scene::materials. A slot is
// a word (word.h): the index of a descriptor (texture_rows.h), or kNoTexture. Needs shaders/scene_tables.glsl.
//
//   row 0  base_color.rgba
//   row 1  emission.rgb, unlit
//   row 2  metallic, roughness, specular, ior
//   row 3  specular_color.rgb, transmission
//   row 4  clearcoat, clearcoat_roughness, normal_scale, clearcoat_normal_scale
//   row 5  alpha_cutoff, slot of base_color_texture, slot of metallic_roughness_texture, slot of normal_texture
//   row 6  slot of emission_texture, slot of specular_texture, slot of specular_color_texture, slot of transmission_texture
//   row 7  slot of clearcoat_texture, slot of clearcoat_roughness_texture, slot of clearcoat_normal_texture, slot of sheen_color_texture
//   row 8  sheen_color.rgb, sheen_roughness
//   row 9  slot of sheen_roughness_texture, anisotropy_strength, anisotropy_rotation, slot of anisotropy_texture
//   row 10  attenuation_color.rgb, thickness
//   row 11  dispersion, slot of iridescence_texture, slot of iridescence_thickness_texture, slot of diffuse_transmission_texture
//   row 12  iridescence, iridescence_ior, iridescence_thickness_minimum, iridescence_thickness_maximum
//   row 13  diffuse_transmission_color.rgb, diffuse_transmission
//   row 14  slot of diffuse_transmission_color_texture
#include "shaders/lib/texture.glsl"
#include "shaders/shared/word.h"

const int kMaterialStride = 15;

vec4 material_row(uint material, int row) {
    return texelFetch(scene_materials, int(material) * kMaterialStride + row);
}

float packed_alpha_cutoff(uint material) { return material_row(material, 5).x; }
float packed_unlit(uint material) { return material_row(material, 1).w; }
vec4 packed_base_color(uint material) { return material_row(material, 0).rgba; }
float packed_metallic(uint material) { return material_row(material, 2).x; }
float packed_roughness(uint material) { return material_row(material, 2).y; }
float packed_normal_scale(uint material) { return material_row(material, 4).z; }
vec3 packed_emission(uint material) { return material_row(material, 1).rgb; }
float packed_ior(uint material) { return material_row(material, 2).w; }
float packed_specular(uint material) { return material_row(material, 2).z; }
vec3 packed_specular_color(uint material) { return material_row(material, 3).rgb; }
float packed_clearcoat(uint material) { return material_row(material, 4).x; }
float packed_clearcoat_roughness(uint material) { return material_row(material, 4).y; }
float packed_clearcoat_normal_scale(uint material) { return material_row(material, 4).w; }
float packed_transmission(uint material) { return material_row(material, 3).w; }
float packed_diffuse_transmission(uint material) { return material_row(material, 13).w; }
vec3 packed_diffuse_transmission_color(uint material) { return material_row(material, 13).rgb; }
float packed_thickness(uint material) { return material_row(material, 10).w; }
vec3 packed_attenuation_color(uint material) { return material_row(material, 10).rgb; }
float packed_dispersion(uint material) { return material_row(material, 11).x; }
vec3 packed_sheen_color(uint material) { return material_row(material, 8).rgb; }
float packed_sheen_roughness(uint material) { return material_row(material, 8).w; }
float packed_anisotropy_strength(uint material) { return material_row(material, 9).y; }
float packed_anisotropy_rotation(uint material) { return material_row(material, 9).z; }
float packed_iridescence(uint material) { return material_row(material, 12).x; }
float packed_iridescence_ior(uint material) { return material_row(material, 12).y; }
float packed_iridescence_thickness_minimum(uint material) { return material_row(material, 12).z; }
float packed_iridescence_thickness_maximum(uint material) { return material_row(material, 12).w; }

uint base_color_texture_slot(uint material) { return word_of_float(material_row(material, 5).y); }
uint normal_texture_slot(uint material) { return word_of_float(material_row(material, 5).w); }
uint metallic_roughness_texture_slot(uint material) { return word_of_float(material_row(material, 5).z); }
uint emission_texture_slot(uint material) { return word_of_float(material_row(material, 6).x); }
uint specular_texture_slot(uint material) { return word_of_float(material_row(material, 6).y); }
uint specular_color_texture_slot(uint material) { return word_of_float(material_row(material, 6).z); }
uint clearcoat_texture_slot(uint material) { return word_of_float(material_row(material, 7).x); }
uint clearcoat_roughness_texture_slot(uint material) { return word_of_float(material_row(material, 7).y); }
uint clearcoat_normal_texture_slot(uint material) { return word_of_float(material_row(material, 7).z); }
uint transmission_texture_slot(uint material) { return word_of_float(material_row(material, 6).w); }
uint diffuse_transmission_texture_slot(uint material) { return word_of_float(material_row(material, 11).w); }
uint diffuse_transmission_color_texture_slot(uint material) { return word_of_float(material_row(material, 14).x); }
uint sheen_color_texture_slot(uint material) { return word_of_float(material_row(material, 7).w); }
uint sheen_roughness_texture_slot(uint material) { return word_of_float(material_row(material, 9).x); }
uint anisotropy_texture_slot(uint material) { return word_of_float(material_row(material, 9).w); }
uint iridescence_texture_slot(uint material) { return word_of_float(material_row(material, 11).y); }
uint iridescence_thickness_texture_slot(uint material) { return word_of_float(material_row(material, 11).z); }

// Properties that no material of the scene needs are constants, which the compiler folds.
struct Material {
    bool unlit;
    vec3 base_color;
    float metallic;
    float roughness;
    float normal_scale;
    vec3 emission;
    float dielectric_f0;
    float specular;
    vec3 specular_color;
    float coat;
    float coat_roughness;
    float coat_normal_scale;
    float transmission;
    float diffuse_transmission;
    vec3 diffuse_transmission_color;
    float thickness;
    vec3 absorption;
    float dispersion;
    vec3 sheen_color;
    float sheen_roughness;
    float anisotropy;
    float anisotropy_rotation;
    float iridescence;
    float film_ior;
    float film_thickness;
    float film_thickness_range;
    vec3 normal;           // n: normal-mapped, on the side of n_g, bent towards wo
    vec3 coat_normal;      // n_k
    bool front;            // true: wo is outside, on the side of the vertex normals
    int channel;           // colour channel of the path, 0 to 2, for solids that disperse light
    bool bent;             // true: wo is behind n as it was before bending, or behind the coat's n_k
    vec3 rough_direction;  // direction of the higher roughness, perpendicular to n; 0: none
};

// Returns the factors; the caller sets the normals and the direction.
Material load_material(uint material) {
    Material m;
    m.unlit = HALFLIGHT_UNLIT != 0 ? packed_unlit(material) != 0.0 : false;
    m.base_color = packed_base_color(material).rgb;
    m.metallic = packed_metallic(material);
    m.roughness = packed_roughness(material);
    m.normal_scale = HALFLIGHT_TEXTURE_NORMAL != 0 ? packed_normal_scale(material) : 1.0;
    m.emission = HALFLIGHT_EMISSION != 0 ? packed_emission(material) : vec3(0.0, 0.0, 0.0);
    m.dielectric_f0 = packed_ior(material);
    m.specular = packed_specular(material);
    m.specular_color = HALFLIGHT_SPECULAR_COLOR != 0 ? packed_specular_color(material) : vec3(1.0, 1.0, 1.0);
    m.coat = HALFLIGHT_CLEARCOAT != 0 ? packed_clearcoat(material) : 0.0;
    m.coat_roughness = HALFLIGHT_CLEARCOAT != 0 ? packed_clearcoat_roughness(material) : 0.0;
    m.coat_normal_scale = HALFLIGHT_TEXTURE_CLEARCOAT_NORMAL != 0 ? packed_clearcoat_normal_scale(material) : 1.0;
    m.transmission = HALFLIGHT_TRANSMISSION != 0 ? packed_transmission(material) : 0.0;
    m.diffuse_transmission = HALFLIGHT_DIFFUSE_TRANSMISSION != 0 ? packed_diffuse_transmission(material) : 0.0;
    m.diffuse_transmission_color = HALFLIGHT_DIFFUSE_TRANSMISSION != 0 ? packed_diffuse_transmission_color(material) : vec3(1.0, 1.0, 1.0);
    m.thickness = HALFLIGHT_VOLUME != 0 ? packed_thickness(material) : 0.0;
    m.absorption = HALFLIGHT_VOLUME != 0 ? packed_attenuation_color(material) : vec3(0.0, 0.0, 0.0);
    m.dispersion = HALFLIGHT_DISPERSION != 0 ? packed_dispersion(material) : 0.0;
    m.sheen_color = HALFLIGHT_SHEEN != 0 ? packed_sheen_color(material) : vec3(0.0, 0.0, 0.0);
    m.sheen_roughness = HALFLIGHT_SHEEN != 0 ? packed_sheen_roughness(material) : 0.0;
    m.anisotropy = HALFLIGHT_ANISOTROPY != 0 ? packed_anisotropy_strength(material) : 0.0;
    m.anisotropy_rotation = HALFLIGHT_ANISOTROPY != 0 ? packed_anisotropy_rotation(material) : 0.0;
    m.iridescence = HALFLIGHT_IRIDESCENCE != 0 ? packed_iridescence(material) : 0.0;
    m.film_ior = HALFLIGHT_IRIDESCENCE != 0 ? packed_iridescence_ior(material) : 1.3;
    m.film_thickness = HALFLIGHT_IRIDESCENCE != 0 ? packed_iridescence_thickness_minimum(material) : 0.0;
    m.film_thickness_range = HALFLIGHT_IRIDESCENCE != 0 ? packed_iridescence_thickness_maximum(material) : 400.0;
    return m;
}

// Multiplies the factors by their textures, except for those that need tangents.
void multiply_textures(inout Material m, uint material, vec2 uv0, vec2 uv1) {
    if (HALFLIGHT_TEXTURE_BASE_COLOR != 0) {
        vec4 texel = color_texture(base_color_texture_slot(material), uv0, uv1);
        m.base_color *= texel.rgb;
    }
    if (HALFLIGHT_TEXTURE_METALLIC_ROUGHNESS != 0) {
        vec4 texel = data_texture(metallic_roughness_texture_slot(material), uv0, uv1);
        m.roughness *= texel.g;
        m.metallic *= texel.b;
    }
    if (HALFLIGHT_TEXTURE_EMISSION != 0) {
        vec4 texel = color_texture(emission_texture_slot(material), uv0, uv1);
        m.emission *= texel.rgb;
    }
    if (HALFLIGHT_TEXTURE_SPECULAR != 0) {
        vec4 texel = data_texture(specular_texture_slot(material), uv0, uv1);
        m.specular *= texel.a;
    }
    if (HALFLIGHT_TEXTURE_SPECULAR_COLOR != 0) {
        vec4 texel = color_texture(specular_color_texture_slot(material), uv0, uv1);
        m.specular_color *= texel.rgb;
    }
    if (HALFLIGHT_TEXTURE_CLEARCOAT != 0) {
        vec4 texel = data_texture(clearcoat_texture_slot(material), uv0, uv1);
        m.coat *= texel.r;
    }
    if (HALFLIGHT_TEXTURE_CLEARCOAT_ROUGHNESS != 0) {
        vec4 texel = data_texture(clearcoat_roughness_texture_slot(material), uv0, uv1);
        m.coat_roughness *= texel.g;
    }
    if (HALFLIGHT_TEXTURE_TRANSMISSION != 0) {
        vec4 texel = data_texture(transmission_texture_slot(material), uv0, uv1);
        m.transmission *= texel.r;
    }
    if (HALFLIGHT_TEXTURE_DIFFUSE_TRANSMISSION != 0) {
        vec4 texel = data_texture(diffuse_transmission_texture_slot(material), uv0, uv1);
        m.diffuse_transmission *= texel.a;
    }
    if (HALFLIGHT_TEXTURE_DIFFUSE_TRANSMISSION_COLOR != 0) {
        vec4 texel = color_texture(diffuse_transmission_color_texture_slot(material), uv0, uv1);
        m.diffuse_transmission_color *= texel.rgb;
    }
    if (HALFLIGHT_TEXTURE_SHEEN_COLOR != 0) {
        vec4 texel = color_texture(sheen_color_texture_slot(material), uv0, uv1);
        m.sheen_color *= texel.rgb;
    }
    if (HALFLIGHT_TEXTURE_SHEEN_ROUGHNESS != 0) {
        vec4 texel = data_texture(sheen_roughness_texture_slot(material), uv0, uv1);
        m.sheen_roughness *= texel.a;
    }
    if (HALFLIGHT_TEXTURE_IRIDESCENCE != 0) {
        vec4 texel = data_texture(iridescence_texture_slot(material), uv0, uv1);
        m.iridescence *= texel.r;
    }
    if (HALFLIGHT_TEXTURE_IRIDESCENCE_THICKNESS != 0) {
        vec4 texel = data_texture(iridescence_thickness_texture_slot(material), uv0, uv1);
        m.film_thickness_range *= texel.g;
    }
}
