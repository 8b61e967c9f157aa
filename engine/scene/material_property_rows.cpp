// The table of material properties.
#include <array>

#include "engine/scene/material_properties.h"
#include "shaders/shared/material_rows.h"

namespace halflight {
namespace {

using M = Material;
using N = MaterialNeeds;

constexpr PropertyRange kFraction{0, 1};
constexpr PropertyRange kNotNegative{.lowest = 0};
constexpr PropertyRange kNotBelowOne{.lowest = 1};
constexpr PropertyRange kFinite{};
// Squares and products of numbers up to this one are finite.
constexpr float kMost = 1e6f;
constexpr PropertyRange kNormalScale{-kMost, kMost};

/// Returns F0 of the dielectric: ((ior - 1) / (ior + 1))^2.
vec4 packed_ior(const M& m) {
    const float r0 = (m.ior - 1) / (m.ior + 1);
    return vec4(r0 * r0, 0, 0, 0);
}

/// Returns 0 if the index of refraction has no colours.
vec4 packed_dispersion(const M& m) {
    return vec4(m.ior < kInfiniteIor ? m.dispersion : 0, 0, 0, 0);
}

/// Returns the absorption per world unit: after the attenuation distance, light has the attenuation colour.
vec4 packed_attenuation(const M& m) {
    constexpr float kLeastColor = 1e-30f, kMostAbsorption = 1e30f;
    if (m.attenuation_distance == 0) return vec4(0);
    const vec3 depth = -glm::log(glm::max(m.attenuation_color, vec3(kLeastColor)));
    return vec4(glm::min(depth / m.attenuation_distance, vec3(kMostAbsorption)), 0);
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
                     .meaning = "false: the camera passes back faces, unless the material transmits light"},
    MaterialProperty{.name = "straight_shadows",
                     .field = &M::straight_shadows,
                     .path = "",
                     .range = kFraction,
                     .meaning = "1: light passes clear solid glass straight on, a bias; dispersion must be 0"},
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
                     .meaning = "0 is smooth, 1 is rough; the alpha of the microfacets is its square"},
    MaterialProperty{.name = "normal_scale",
                     .field = &M::normal_scale,
                     .path = "/normalTexture/scale",
                     .range = kNormalScale,
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
                     .meaning = "emitted radiance, nits: factor times strength of the file"},
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
                     .range = kNormalScale,
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
        .range = {0, kMost},
        .packing = {11, 0},
        .shader = "dispersion",
        .need = &N::dispersion,
        .scales_lobe = true,
        .packed = packed_dispersion,
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
                     .range = {1, kMost},
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

}  // namespace

std::span<const MaterialProperty> material_properties() {
    return kProperties;
}

}  // namespace halflight
