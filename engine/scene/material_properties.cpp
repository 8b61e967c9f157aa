#include "engine/scene/material_properties.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/core/error.h"
#include "shaders/shared/material.h"
#include "shaders/shared/specular_chain.h"
#include "shaders/shared/surface.h"

namespace halflight {
namespace {

using M = Material;
using N = MaterialNeeds;

constexpr PropertyRange kFraction{0, 1};
constexpr PropertyRange kNotNegative{.lowest = 0};
constexpr PropertyRange kNotBelowOne{.lowest = 1};
constexpr PropertyRange kFinite{};

// --- Predicates on a material -----------------------------------------------------------------------------------

bool always(const M&) {
    return true;
}
bool lit(const M& m) {
    return !m.unlit;
}
bool dielectric(const M& m) {
    return lit(m) && (m.metallic < 1 || m.metallic_roughness_texture);
}
/// Returns whether something lies under the dielectric's reflection.
bool base(const M& m) {
    return dielectric(m) && vec3(m.base_color) != vec3(0);
}
bool specular(const M& m) {
    return dielectric(m) && m.specular > 0;
}
bool coated(const M& m) {
    return lit(m) && m.clearcoat > 0;
}
bool has_sheen(const M& m) {
    return lit(m) && m.sheen_color != vec3(0);
}
bool transmits(const M& m) {
    return base(m) && m.transmission > 0;
}
bool translucent(const M& m) {
    return dielectric(m) && m.diffuse_transmission > 0 && (m.transmission < 1 || m.transmission_texture);
}
bool iridescent(const M& m) {
    return lit(m) && m.iridescence > 0;
}
bool anisotropic(const M& m) {
    return lit(m) && m.anisotropy_strength > 0;
}
bool glossy(const M& m) {
    return (lit(m) && m.metallic > 0) || specular(m);
}
bool sharp(const M& m) {
    const auto smooth = [](float roughness, const TextureRef& texture) {
        return texture || roughness <= shared::kMostSharpRoughness;
    };
    return ((glossy(m) || transmits(m)) && smooth(m.roughness, m.metallic_roughness_texture)) ||
           (coated(m) && smooth(m.clearcoat_roughness, m.clearcoat_roughness_texture));
}
bool is_solid(const M& m) {
    return (transmits(m) || translucent(m)) && m.thickness > 0;
}
bool disperses(const M& m) {
    return transmits(m) && is_solid(m) && m.dispersion > 0 && m.ior > 1;
}

// --- Packing ----------------------------------------------------------------------------------------------------

/// Returns F0 of the dielectric: ((ior - 1) / (ior + 1))^2.
vec4 packed_ior(const M& m) {
    const float r0 = (m.ior - 1) / (m.ior + 1);
    return vec4(r0 * r0, 0, 0, 0);
}

/// Returns the absorption per world unit: after the attenuation distance, light has the attenuation colour.
vec4 packed_attenuation(const M& m) {
    constexpr float kLeastColor = 1e-30f, kMost = 1e30f;
    if (m.attenuation_distance == 0) return vec4(0);
    const vec3 depth = -glm::log(glm::max(m.attenuation_color, vec3(kLeastColor)));
    return vec4(glm::min(depth / m.attenuation_distance, vec3(kMost)), 0);
}

/// Returns the cutoff of mask, kAlphaBlend of blend and 0 of opaque materials.
vec4 packed_cutoff(const M& m) {
    const float cutoff = m.alpha_mode == AlphaMode::blend  ? shared::kAlphaBlend
                         : m.alpha_mode == AlphaMode::mask ? m.alpha_cutoff
                                                           : 0.0f;
    return vec4(cutoff, 0, 0, 0);
}

/// Returns the thickness without a texture; with one, the texture's share goes from the minimum to this one.
vec4 packed_thickness_minimum(const M& m) {
    return vec4(m.iridescence_thickness_texture ? m.iridescence_thickness_minimum : 0, 0, 0, 0);
}
vec4 packed_thickness_range(const M& m) {
    return vec4(m.iridescence_thickness_maximum - packed_thickness_minimum(m).x, 0, 0, 0);
}

// --- Rows -------------------------------------------------------------------------------------------------------

const std::array kProperties = {
    MaterialProperty{.name = "alpha_cutoff",
                     .field = &M::alpha_cutoff,
                     .path = "/alphaCutoff",
                     .range = kNotNegative,
                     .packing = {5, 0},
                     .packed = packed_cutoff,
                     .meaning = "coverage below which alpha mode MASK lets rays pass; packed with the alpha mode"},
    MaterialProperty{.name = "double_sided",
                     .field = &M::double_sided,
                     .path = "/doubleSided",
                     .range = kFraction,
                     .meaning = "kept for tools: light transport treats every surface as two-sided"},
    MaterialProperty{.name = "unlit",
                     .field = &M::unlit,
                     .path = "/extensions/KHR_materials_unlit",
                     .range = kFraction,
                     .packing = {1, 3},
                     .shader = "unlit",
                     .need = &N::unlit,
                     .meaning = "the base colour is emitted and nothing is reflected"},
    MaterialProperty{.name = "base_color",
                     .field = &M::base_color,
                     .path = "/pbrMetallicRoughness/baseColorFactor",
                     .range = kFraction,
                     .packing = {0, 0},
                     .shader = "base_color",
                     .meaning = "linear colour of the diffuse lobe and of metals; alpha: coverage"},
    MaterialProperty{.name = "metallic",
                     .field = &M::metallic,
                     .path = "/pbrMetallicRoughness/metallicFactor",
                     .range = kFraction,
                     .packing = {2, 0},
                     .shader = "metallic",
                     .scales_lobe = true,
                     .meaning = "share of metal, 0: dielectric"},
    MaterialProperty{.name = "roughness",
                     .field = &M::roughness,
                     .path = "/pbrMetallicRoughness/roughnessFactor",
                     .range = kFraction,
                     .packing = {2, 1},
                     .shader = "roughness",
                     .meaning = "perceptual roughness: alpha = roughness^2"},
    MaterialProperty{.name = "normal_scale",
                     .field = &M::normal_scale,
                     .path = "/normalTexture/scale",
                     .range = kFinite,
                     .packing = {4, 2},
                     .shader = "normal_scale",
                     .need = &N::normal_texture,
                     .meaning = "factor for x and y of the normal map"},
    MaterialProperty{.name = "emission",
                     .field = &M::emission,
                     .path = "/emissiveFactor",
                     .range = kNotNegative,
                     .packing = {1, 0},
                     .shader = "emission",
                     .need = &N::emission,
                     .scales_lobe = true,
                     .animated = AnimatedProperty::emission,
                     .meaning = "emitted radiance, nits; the file's value times emissiveStrength"},
    MaterialProperty{.name = "ior",
                     .field = &M::ior,
                     .path = "/extensions/KHR_materials_ior/ior",
                     .range = kNotBelowOne,
                     .packing = {2, 3},
                     .shader = "dielectric_f0",
                     .packed = packed_ior,
                     .meaning = "index of refraction; packed as ((ior - 1) / (ior + 1))^2"},
    MaterialProperty{.name = "specular",
                     .field = &M::specular,
                     .path = "/extensions/KHR_materials_specular/specularFactor",
                     .range = kFraction,
                     .packing = {2, 2},
                     .shader = "specular",
                     .scales_lobe = true,
                     .meaning = "strength of the dielectric's reflection"},
    MaterialProperty{.name = "specular_color",
                     .field = &M::specular_color,
                     .path = "/extensions/KHR_materials_specular/specularColorFactor",
                     .range = kNotNegative,
                     .packing = {3, 0},
                     .shader = "specular_color",
                     .need = &N::specular_color,
                     .meaning = "linear colour of the dielectric's reflection at normal incidence"},
    MaterialProperty{.name = "clearcoat",
                     .field = &M::clearcoat,
                     .path = "/extensions/KHR_materials_clearcoat/clearcoatFactor",
                     .range = kFraction,
                     .packing = {4, 0},
                     .shader = "coat",
                     .need = &N::clearcoat,
                     .scales_lobe = true,
                     .meaning = "strength of the coat"},
    MaterialProperty{.name = "clearcoat_roughness",
                     .field = &M::clearcoat_roughness,
                     .path = "/extensions/KHR_materials_clearcoat/clearcoatRoughnessFactor",
                     .range = kFraction,
                     .packing = {4, 1},
                     .shader = "coat_roughness",
                     .need = &N::clearcoat,
                     .meaning = "perceptual roughness of the coat"},
    MaterialProperty{.name = "clearcoat_normal_scale",
                     .field = &M::clearcoat_normal_scale,
                     .path = "/extensions/KHR_materials_clearcoat/clearcoatNormalTexture/scale",
                     .range = kFinite,
                     .packing = {4, 3},
                     .shader = "coat_normal_scale",
                     .need = &N::clearcoat_normal_texture,
                     .meaning = "factor for x and y of the coat's normal map"},
    MaterialProperty{.name = "transmission",
                     .field = &M::transmission,
                     .path = "/extensions/KHR_materials_transmission/transmissionFactor",
                     .range = kFraction,
                     .packing = {3, 3},
                     .shader = "transmission",
                     .need = &N::transmission,
                     .scales_lobe = true,
                     .meaning = "share of light that passes the surface instead of being scattered diffusely"},
    MaterialProperty{.name = "diffuse_transmission",
                     .field = &M::diffuse_transmission,
                     .path = "/extensions/KHR_materials_diffuse_transmission/diffuseTransmissionFactor",
                     .range = kFraction,
                     .packing = {13, 3},
                     .shader = "diffuse_transmission",
                     .need = &N::diffuse_transmission,
                     .scales_lobe = true,
                     .meaning = "share of diffuse light that leaves on the other side of the surface"},
    MaterialProperty{.name = "diffuse_transmission_color",
                     .field = &M::diffuse_transmission_color,
                     .path = "/extensions/KHR_materials_diffuse_transmission/diffuseTransmissionColorFactor",
                     .range = kFraction,
                     .packing = {13, 0},
                     .shader = "diffuse_transmission_color",
                     .need = &N::diffuse_transmission,
                     .meaning = "linear colour of this light"},
    MaterialProperty{
        .name = "thickness",
        .field = &M::thickness,
        .path = "/extensions/KHR_materials_volume/thicknessFactor",
        .range = kNotNegative,
        .packing = {10, 3},
        .shader = "thickness",
        .need = &N::volume,
        .scales_lobe = true,
        .meaning = "0: thin-walled; > 0: solid, and only rays that never leave use the value as their path"},
    MaterialProperty{
        .name = "attenuation_color",
        .field = &M::attenuation_color,
        .path = "/extensions/KHR_materials_volume/attenuationColor",
        .range = kFraction,
        .packing = {10, 0},
        .shader = "absorption",
        .need = &N::volume,
        .packed = packed_attenuation,
        .meaning = "colour of white light after the attenuation distance; packed as absorption per world unit"},
    MaterialProperty{.name = "attenuation_distance",
                     .field = &M::attenuation_distance,
                     .path = "/extensions/KHR_materials_volume/attenuationDistance",
                     .range = kNotNegative,
                     .need = &N::volume,
                     .meaning = "world units of the attenuation colour; 0: infinite; packed with the colour"},
    MaterialProperty{
        .name = "dispersion",
        .field = &M::dispersion,
        .path = "/extensions/KHR_materials_dispersion/dispersion",
        .range = kNotNegative,
        .packing = {11, 0},
        .shader = "dispersion",
        .need = &N::dispersion,
        .scales_lobe = true,
        .meaning = "spread of the index of refraction of solids over the colours: 20 over the Abbe number"},
    MaterialProperty{.name = "sheen_color",
                     .field = &M::sheen_color,
                     .path = "/extensions/KHR_materials_sheen/sheenColorFactor",
                     .range = kFraction,
                     .packing = {8, 0},
                     .shader = "sheen_color",
                     .need = &N::sheen,
                     .scales_lobe = true,
                     .meaning = "linear colour of the sheen"},
    MaterialProperty{.name = "sheen_roughness",
                     .field = &M::sheen_roughness,
                     .path = "/extensions/KHR_materials_sheen/sheenRoughnessFactor",
                     .range = kFraction,
                     .packing = {8, 3},
                     .shader = "sheen_roughness",
                     .need = &N::sheen,
                     .meaning = "perceptual roughness of the sheen"},
    MaterialProperty{.name = "anisotropy_strength",
                     .field = &M::anisotropy_strength,
                     .path = "/extensions/KHR_materials_anisotropy/anisotropyStrength",
                     .range = kFraction,
                     .packing = {9, 1},
                     .shader = "anisotropy",
                     .need = &N::anisotropy,
                     .scales_lobe = true,
                     .meaning = "anisotropy of specular and transmission; b of `anisotropy_texture` multiplies it"},
    MaterialProperty{.name = "anisotropy_rotation",
                     .field = &M::anisotropy_rotation,
                     .path = "/extensions/KHR_materials_anisotropy/anisotropyRotation",
                     .range = kFinite,
                     .packing = {9, 2},
                     .shader = "anisotropy_rotation",
                     .need = &N::anisotropy,
                     .meaning = "radians from the tangent towards the bitangent, added to the texture's direction"},
    MaterialProperty{.name = "iridescence",
                     .field = &M::iridescence,
                     .path = "/extensions/KHR_materials_iridescence/iridescenceFactor",
                     .range = kFraction,
                     .packing = {12, 0},
                     .shader = "iridescence",
                     .need = &N::iridescence,
                     .scales_lobe = true,
                     .meaning = "share of the specular lobe whose Fresnel term is that of a thin film"},
    MaterialProperty{.name = "iridescence_ior",
                     .field = &M::iridescence_ior,
                     .path = "/extensions/KHR_materials_iridescence/iridescenceIor",
                     .range = kNotBelowOne,
                     .packing = {12, 1},
                     .shader = "film_ior",
                     .need = &N::iridescence,
                     .meaning = "index of refraction of the film"},
    MaterialProperty{.name = "iridescence_thickness_minimum",
                     .field = &M::iridescence_thickness_minimum,
                     .path = "/extensions/KHR_materials_iridescence/iridescenceThicknessMinimum",
                     .range = kNotNegative,
                     .packing = {12, 2},
                     .shader = "film_thickness",
                     .need = &N::iridescence,
                     .packed = packed_thickness_minimum,
                     .meaning = "thickness of the film in nanometres where the texture is 0; packed as 0 without one"},
    MaterialProperty{.name = "iridescence_thickness_maximum",
                     .field = &M::iridescence_thickness_maximum,
                     .path = "/extensions/KHR_materials_iridescence/iridescenceThicknessMaximum",
                     .range = kNotNegative,
                     .packing = {12, 3},
                     .shader = "film_thickness_range",
                     .need = &N::iridescence,
                     .packed = packed_thickness_range,
                     .meaning = "thickness of the film in nanometres; packed as the difference from the minimum"},
};

const std::array kTextures = {
    MaterialTexture{"base_color_texture",
                    &M::base_color_texture,
                    "/pbrMetallicRoughness/baseColorTexture",
                    TextureUse::color,
                    {{"base_color", "rgb"}},
                    always,
                    {5, 1},
                    &N::base_color_texture,
                    nullptr,
                    "TEXTURE_BASE_COLOR",
                    "base colour textures",
                    "no material has one"},
    MaterialTexture{"normal_texture",
                    &M::normal_texture,
                    "/normalTexture",
                    TextureUse::normal_map,
                    {},
                    lit,
                    {5, 3},
                    &N::normal_texture,
                    nullptr,
                    "TEXTURE_NORMAL",
                    "normal maps",
                    "no material has one, or no mesh tangents"},
    MaterialTexture{"metallic_roughness_texture",
                    &M::metallic_roughness_texture,
                    "/pbrMetallicRoughness/metallicRoughnessTexture",
                    TextureUse::data,
                    {{"roughness", "g"}, {"metallic", "b"}},
                    lit,
                    {5, 2},
                    &N::metallic_roughness_texture,
                    nullptr,
                    "TEXTURE_METALLIC_ROUGHNESS",
                    "metallic-roughness textures",
                    "no material has one"},
    MaterialTexture{"emission_texture",
                    &M::emission_texture,
                    "/emissiveTexture",
                    TextureUse::color,
                    {{"emission", "rgb"}},
                    has_emission,
                    {6, 0},
                    &N::emission_texture,
                    &N::emission,
                    "TEXTURE_EMISSION",
                    "emission textures",
                    "no material that glows has one"},
    MaterialTexture{"specular_texture",
                    &M::specular_texture,
                    "/extensions/KHR_materials_specular/specularTexture",
                    TextureUse::data,
                    {{"specular", "a"}},
                    specular,
                    {6, 1},
                    &N::specular_texture,
                    &N::glossy,
                    "TEXTURE_SPECULAR",
                    "specular textures",
                    "no material has one"},
    MaterialTexture{"specular_color_texture",
                    &M::specular_color_texture,
                    "/extensions/KHR_materials_specular/specularColorTexture",
                    TextureUse::color,
                    {{"specular_color", "rgb"}},
                    specular,
                    {6, 2},
                    &N::specular_color_texture,
                    &N::specular_color,
                    "TEXTURE_SPECULAR_COLOR",
                    "specular colour textures",
                    "no material has one"},
    MaterialTexture{"clearcoat_texture",
                    &M::clearcoat_texture,
                    "/extensions/KHR_materials_clearcoat/clearcoatTexture",
                    TextureUse::data,
                    {{"coat", "r"}},
                    coated,
                    {7, 0},
                    &N::clearcoat_texture,
                    &N::clearcoat,
                    "TEXTURE_CLEARCOAT",
                    "coat textures",
                    "no coat has one"},
    MaterialTexture{"clearcoat_roughness_texture",
                    &M::clearcoat_roughness_texture,
                    "/extensions/KHR_materials_clearcoat/clearcoatRoughnessTexture",
                    TextureUse::data,
                    {{"coat_roughness", "g"}},
                    coated,
                    {7, 1},
                    &N::clearcoat_roughness_texture,
                    &N::clearcoat,
                    "TEXTURE_CLEARCOAT_ROUGHNESS",
                    "coat roughness textures",
                    "no coat has one"},
    MaterialTexture{"clearcoat_normal_texture",
                    &M::clearcoat_normal_texture,
                    "/extensions/KHR_materials_clearcoat/clearcoatNormalTexture",
                    TextureUse::normal_map,
                    {},
                    coated,
                    {7, 2},
                    &N::clearcoat_normal_texture,
                    &N::clearcoat,
                    "TEXTURE_CLEARCOAT_NORMAL",
                    "coat normal maps",
                    "no coat has one, or no mesh tangents"},
    MaterialTexture{"transmission_texture",
                    &M::transmission_texture,
                    "/extensions/KHR_materials_transmission/transmissionTexture",
                    TextureUse::data,
                    {{"transmission", "r"}},
                    transmits,
                    {6, 3},
                    &N::transmission_texture,
                    &N::transmission,
                    "TEXTURE_TRANSMISSION",
                    "transmission textures",
                    "no material has one"},
    MaterialTexture{"diffuse_transmission_texture",
                    &M::diffuse_transmission_texture,
                    "/extensions/KHR_materials_diffuse_transmission/diffuseTransmissionTexture",
                    TextureUse::data,
                    {{"diffuse_transmission", "a"}},
                    translucent,
                    {11, 3},
                    &N::diffuse_transmission_texture,
                    &N::diffuse_transmission,
                    "TEXTURE_DIFFUSE_TRANSMISSION",
                    "diffuse transmission textures",
                    "no material has one"},
    MaterialTexture{"diffuse_transmission_color_texture",
                    &M::diffuse_transmission_color_texture,
                    "/extensions/KHR_materials_diffuse_transmission/diffuseTransmissionColorTexture",
                    TextureUse::color,
                    {{"diffuse_transmission_color", "rgb"}},
                    translucent,
                    {14, 0},
                    &N::diffuse_transmission_color_texture,
                    &N::diffuse_transmission,
                    "TEXTURE_DIFFUSE_TRANSMISSION_COLOR",
                    "diffuse transmission colour textures",
                    "no material has one"},
    MaterialTexture{"sheen_color_texture",
                    &M::sheen_color_texture,
                    "/extensions/KHR_materials_sheen/sheenColorTexture",
                    TextureUse::color,
                    {{"sheen_color", "rgb"}},
                    has_sheen,
                    {7, 3},
                    &N::sheen_color_texture,
                    &N::sheen,
                    "TEXTURE_SHEEN_COLOR",
                    "sheen colour textures",
                    "no sheen has one"},
    MaterialTexture{"sheen_roughness_texture",
                    &M::sheen_roughness_texture,
                    "/extensions/KHR_materials_sheen/sheenRoughnessTexture",
                    TextureUse::data,
                    {{"sheen_roughness", "a"}},
                    has_sheen,
                    {9, 0},
                    &N::sheen_roughness_texture,
                    &N::sheen,
                    "TEXTURE_SHEEN_ROUGHNESS",
                    "sheen roughness textures",
                    "no sheen has one"},
    MaterialTexture{"anisotropy_texture",
                    &M::anisotropy_texture,
                    "/extensions/KHR_materials_anisotropy/anisotropyTexture",
                    TextureUse::direction,
                    {},
                    anisotropic,
                    {9, 3},
                    &N::anisotropy_texture,
                    &N::anisotropy,
                    "TEXTURE_ANISOTROPY",
                    "anisotropy textures",
                    "no anisotropic material has one, or no mesh tangents"},
    MaterialTexture{"iridescence_texture",
                    &M::iridescence_texture,
                    "/extensions/KHR_materials_iridescence/iridescenceTexture",
                    TextureUse::data,
                    {{"iridescence", "r"}},
                    iridescent,
                    {11, 1},
                    &N::iridescence_texture,
                    &N::iridescence,
                    "TEXTURE_IRIDESCENCE",
                    "iridescence textures",
                    "no film has one"},
    MaterialTexture{"iridescence_thickness_texture",
                    &M::iridescence_thickness_texture,
                    "/extensions/KHR_materials_iridescence/iridescenceThicknessTexture",
                    TextureUse::data,
                    {{"film_thickness_range", "g"}},
                    iridescent,
                    {11, 2},
                    &N::iridescence_thickness_texture,
                    &N::iridescence,
                    "TEXTURE_IRIDESCENCE_THICKNESS",
                    "film thickness textures",
                    "no film has one"},
};

const std::array kLobes = {
    MaterialLobe{.label = "unlit surfaces",
                 .need = &N::unlit,
                 .define = "UNLIT",
                 .fact = "no material is unlit",
                 .present = [](const M& m) { return m.unlit; },
                 .implies = &N::emission},
    MaterialLobe{.label = "diffuse transmission",
                 .need = &N::diffuse_transmission,
                 .define = "DIFFUSE_TRANSMISSION",
                 .fact = "no material transmits light diffusely",
                 .present = translucent,
                 .implies = &N::diffuse,
                 .record_rows = 1},
    MaterialLobe{.label = "diffuse lobe",
                 .need = &N::diffuse,
                 .define = "DIFFUSE",
                 .fact = "no material has a diffuse component",
                 .present = [](const M& m) { return base(m) && (m.transmission < 1 || m.transmission_texture); }},
    MaterialLobe{.label = "glossy lobe",
                 .need = &N::glossy,
                 .define = "GLOSSY",
                 .fact = "no material has a specular, coat, sheen or transmission component",
                 .present = glossy,
                 .record_rows = 2,
                 .layer_rows = 2},
    MaterialLobe{.label = "mirrors and clear glass",
                 .need = &N::sharp,
                 .define = "SHARP",
                 .fact = "no lobe has a roughness of 0.1 or less",
                 .present = sharp,
                 .implies = &N::glossy},
    MaterialLobe{.label = "clearcoat",
                 .need = &N::clearcoat,
                 .define = "CLEARCOAT",
                 .fact = "no material has a coat",
                 .present = coated,
                 .implies = &N::glossy,
                 .record_rows = 1,
                 .layer_rows = 1},
    MaterialLobe{.label = "dispersion",
                 .need = &N::dispersion,
                 .define = "DISPERSION",
                 .fact = "every solid refracts all colours alike",
                 .present = disperses,
                 .implies = &N::volume},
    MaterialLobe{.label = "volume",
                 .need = &N::volume,
                 .define = "VOLUME",
                 .fact = "no material is solid",
                 .present = is_solid,
                 .implies = &N::transmission,  // the next row, which implies the glossy lobe
                 .record_rows = 3},
    MaterialLobe{.label = "transmission",
                 .need = &N::transmission,
                 .define = "TRANSMISSION",
                 .fact = "no material transmits light",
                 .present = transmits,
                 .implies = &N::glossy,
                 .record_rows = 1},
    MaterialLobe{.label = "sheen",
                 .need = &N::sheen,
                 .define = "SHEEN",
                 .fact = "no material has a sheen",
                 .present = has_sheen,
                 .implies = &N::glossy,
                 .record_rows = 2,
                 .layer_rows = 1},
    MaterialLobe{.label = "anisotropy",
                 .need = &N::anisotropy,
                 .define = "ANISOTROPY",
                 .fact = "no material is anisotropic, or no mesh has tangents",
                 .present = anisotropic,
                 .implies = &N::glossy,
                 .record_rows = 1,
                 .layer_rows = 1,
                 .tangents = true},
    MaterialLobe{.label = "iridescence",
                 .need = &N::iridescence,
                 .define = "IRIDESCENCE",
                 .fact = "no material has a thin film",
                 .present = iridescent,
                 .implies = &N::glossy,
                 .record_rows = 4,
                 .layer_rows = 2},
    MaterialLobe{
        .label = "specular colour",
        .need = &N::specular_color,
        .define = "SPECULAR_COLOR",
        .fact = "every dielectric reflects white",
        .present = [](const M& m) { return specular(m) && (m.specular_color != vec3(1) || m.specular_color_texture); },
        .implies = &N::glossy},
    MaterialLobe{.label = "emission",
                 .need = &N::emission,
                 .define = "EMISSION",
                 .fact = "no surface glows",
                 .present = has_emission},
};

int lobe_rows(const N& needs, int MaterialLobe::*rows) {
    int sum = 0;
    for (const MaterialLobe& lobe : kLobes) sum += needs.*lobe.need ? lobe.*rows : 0;
    return sum;
}

}  // namespace

bool has_emission(const Material& material) {
    return lit(material) && glm::any(glm::greaterThan(material.emission, vec3(0)));
}

std::span<const MaterialProperty> material_properties() {
    return kProperties;
}

std::span<const MaterialTexture> material_textures() {
    return kTextures;
}

std::span<const MaterialLobe> material_lobes() {
    return kLobes;
}

int material_rows() {
    static const int rows = [] {
        int last = kNone;
        for (const MaterialProperty& property : kProperties) last = std::max(last, property.packing.row);
        for (const MaterialTexture& texture : kTextures) last = std::max(last, texture.packing.row);
        return last + 1;
    }();
    return rows;
}

int record_rows(const MaterialNeeds& needs) {
    return shared::kLeastSurfaceRows + lobe_rows(needs, &MaterialLobe::record_rows);
}

int layer_rows(const MaterialNeeds& needs) {
    return 1 + lobe_rows(needs, &MaterialLobe::layer_rows);  // the first row is the base's
}

int component_count(const MaterialField& field) {
    return std::holds_alternative<vec3 M::*>(field) ? 3 : std::holds_alternative<vec4 M::*>(field) ? 4 : 1;
}

vec4 value_of(const Material& material, const MaterialField& field) {
    return std::visit(
        [&]<class T>(T M::*member) {
            const T& value = material.*member;
            if constexpr (std::is_same_v<T, vec3>)
                return vec4(value, 0);
            else if constexpr (std::is_same_v<T, vec4>)
                return value;
            else
                return vec4(static_cast<float>(value), 0, 0, 0);
        },
        field);
}

void set_value(Material& material, const MaterialField& field, const vec4& value) {
    std::visit(
        [&]<class T>(T M::*member) {
            if constexpr (std::is_same_v<T, bool>)
                material.*member = value.x != 0;
            else if constexpr (std::is_same_v<T, float>)
                material.*member = value.x;
            else
                material.*member = T(value);
        },
        field);
}

vec4 packed_value(const Material& material, const MaterialProperty& property) {
    if (material.unlit && property.scales_lobe) return vec4(0);
    return property.packed ? property.packed(material) : value_of(material, property.field);
}

std::string range_error(const MaterialProperty& property, const vec4& value) {
    for (int i = 0; i < component_count(property.field); ++i)
        if (std::string why = range_error(property.range, value[i]); !why.empty()) return why;
    return {};
}

void set_property(Material& material, std::string_view name, std::span<const float> values, std::string_view subject) {
    const auto found = std::ranges::find(kProperties, name, &MaterialProperty::name);
    if (found == kProperties.end()) throw Error(subject, "materials have no property '{}'", name);
    const auto count = static_cast<std::size_t>(component_count(found->field));
    if (values.size() != count) throw Error(subject, "{} takes {} numbers, not {}", name, count, values.size());
    vec4 value(0);
    for (std::size_t i = 0; i < count; ++i) value[static_cast<int>(i)] = values[i];
    if (const std::string why = range_error(*found, value); !why.empty()) throw Error(subject, "{}: {}", name, why);
    set_value(material, found->field, value);
}

void complete(MaterialNeeds& needs) {
    for (const MaterialTexture& texture : kTextures)
        if (needs.*texture.need && texture.implies) needs.*texture.implies = true;
    for (const MaterialLobe& lobe : kLobes)
        if (needs.*lobe.need && lobe.implies) needs.*lobe.implies = true;
}

}  // namespace halflight
