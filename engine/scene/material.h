// The material of a surface and its textures as plain values, and the needs of a scene's materials. shaders/SHADING.md
// defines the properties; material_properties.h has the table of them.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "engine/core/math.h"
#include "engine/core/shared_bytes.h"

namespace halflight {

inline constexpr int kNone = -1;  ///< "no such element" for every index of the scene
/// Index of Scene::light_groups of lights that no group names. They are in the last one.
inline constexpr std::uint32_t kNoLightGroup = 0xffffffffu;

/// The objects that a light lights, and those that cast its shadows: one bit for each Instance::link_class. This is a
/// departure from physics that pictures name.
struct LightLinks {
    std::uint64_t receivers = ~std::uint64_t{0};
    std::uint64_t blockers = ~std::uint64_t{0};
    bool operator==(const LightLinks&) const = default;
};
inline constexpr std::size_t kMostLinkClasses = 64;  ///< number of classes of objects
/// Returns the objects that both links have.
inline LightLinks both(const LightLinks& a, const LightLinks& b) {
    return {a.receivers & b.receivers, a.blockers & b.blockers};
}

/// Index of refraction from which on a surface reflects all light and disperses none. It stands for glTF's `ior` 0.
inline constexpr float kInfiniteIor = 1e9f;

enum class Wrap : std::uint8_t { repeat, mirrored_repeat, clamp_to_edge };

class ImageTiles;

/// Decoded image: RGBA, row-major, top row first. The slot that refers to it says whether it is sRGB-encoded.
struct TextureImage {
    std::string name;
    int width = 0;      // width, texels, > 0
    int height = 0;     // height, texels, > 0
    SharedBytes rgba;   // 4 * pitch() * height bytes, shared by all poses of a scene; empty if there are tiles
    bool deep = false;  // true: 16 bits; the four high bytes of a texel are before its four low bytes
    std::shared_ptr<const ImageTiles>
        tiles{};  // texels that are not in memory (image_tiles.h); null: they are in `rgba`
    // Mip levels 1 and up, for lookups as colour and as data (texture_levels.h); empty: lookups use level 0.
    std::vector<TextureImage> color_levels{}, data_levels{};

    int pitch() const { return deep ? 2 * width : width; }        ///< Returns four-byte groups of a row.
    std::size_t texel_bytes() const { return deep ? 8 : 4; }      ///< Returns the bytes of a texel.
    std::uint32_t largest() const { return deep ? 65535 : 255; }  ///< Returns the code that stands for 1.
    /// Returns the code of channel `c` of a texel, whose bytes are given.
    std::uint32_t code(const std::uint8_t* texel, std::size_t c) const {
        return deep ? std::uint32_t{texel[c]} << 8 | texel[4 + c] : texel[c];
    }
};

/// Reference to a texture. (u, v) = uv_transform * (s, t, 1); v runs from the top row down (glTF 2.0, section 3.8).
struct TextureRef {
    int image = kNone;  // index into Scene::images
    int uv_set = 0;     // set of texture coordinates, 0 or 1
    Wrap wrap_u = Wrap::repeat;
    Wrap wrap_v = Wrap::repeat;
    bool nearest = false;                                          // true: nearest texel; false: bilinear interpolation
    glm::mat3x2 uv_transform{vec2(1, 0), vec2(0, 1), vec2(0, 0)};  // columns of KHR_texture_transform's matrix
    explicit operator bool() const { return image != kNone; }
};

enum class AlphaMode : std::uint8_t { opaque, mask, blend };

/// Material of a surface. material_properties() and material_textures() list ranges, glTF names and channels.
struct Material {
    std::string name;
    AlphaMode alpha_mode = AlphaMode::opaque;
    float alpha_cutoff = 0.5f;
    bool double_sided = false;  // glTF's flag, for tools: light transport is always two-sided
    bool unlit = false;         // true: the base colour is emitted, nothing is reflected
    vec4 base_color{1};         // linear rgb; a: coverage
    TextureRef base_color_texture;
    float metallic = 1;
    float roughness = 1;  // perceptual, [0, 1]; alpha = roughness^2
    TextureRef metallic_roughness_texture;
    TextureRef normal_texture;
    float normal_scale = 1;
    vec3 emission{0};  // radiance: emissiveFactor x emissiveStrength
    TextureRef emission_texture;
    float ior = 1.5f;  // at least 1
    float specular = 1;
    TextureRef specular_texture;
    vec3 specular_color{1};
    TextureRef specular_color_texture;
    float clearcoat = 0;
    TextureRef clearcoat_texture;
    float clearcoat_roughness = 0;
    TextureRef clearcoat_roughness_texture;
    TextureRef clearcoat_normal_texture;
    float clearcoat_normal_scale = 1;
    float transmission = 0;  // share of transmitted light
    TextureRef transmission_texture;
    float diffuse_transmission = 0;  // share of diffuse light that leaves on the other side
    TextureRef diffuse_transmission_texture;
    vec3 diffuse_transmission_color{1};
    TextureRef diffuse_transmission_color_texture;
    float thickness = 0;            // 0: a thin wall; > 0: the surface bounds a solid, and rays measure its thickness
    bool straight_shadows = false;  // true: light passes clear solid glass straight on (SHADING.md, Panes), a bias
    vec3 attenuation_color{1};
    float attenuation_distance = 0;  // world units after which white light has the attenuation colour; 0: infinite
    float dispersion = 0;            // 20 over the Abbe number; 0: none
    vec3 sheen_color{0};
    TextureRef sheen_color_texture;
    float sheen_roughness = 0;  // perceptual, [0, 1]; alpha = roughness^2
    TextureRef sheen_roughness_texture;
    float anisotropy_strength = 0;  // [0, 1]; alpha along the direction is mix(alpha, 1, strength^2)
    float anisotropy_rotation = 0;  // radians, direction of higher roughness, from the tangent to the bitangent
    TextureRef anisotropy_texture;
    float iridescence = 0;  // share of the reflection that a thin film replaces
    TextureRef iridescence_texture;
    float iridescence_ior = 1.3f;
    float iridescence_thickness_minimum = 100;  // nanometres; counts only with a texture
    float iridescence_thickness_maximum = 400;
    TextureRef iridescence_thickness_texture;
    std::uint32_t light_group = kNoLightGroup;
    LightLinks links{};  // links of the light that surfaces emit
};

/// Lobes and texture slots that some material of a scene uses. Shaders leave out all others (engine/tables/needs.h).
struct MaterialNeeds {
    bool unlit = false;
    bool diffuse = false;               // some material scatters diffusely
    bool diffuse_transmission = false;  // some material scatters diffusely to the other side
    bool glossy = false;                // some material reflects specularly, has a coat or a sheen or transmits
    bool clearcoat = false;
    bool transmission = false;
    bool dispersion = false;  // the index of refraction of some solid depends on the colour
    bool volume = false;      // some material that transmits light, diffusely or not, is solid
    bool sheen = false;
    bool sharp = false;           // some lobe is so smooth that specular chains follow it
    bool anisotropy = false;      // some lobe is anisotropic, on a mesh with tangents
    bool iridescence = false;     // some surface has a thin film
    bool specular_color = false;  // some dielectric's specular colour is not white
    bool emission = false;        // some surface emits light, unlit ones included

    bool base_color_texture = false;
    bool metallic_roughness_texture = false;
    bool normal_texture = false;
    bool emission_texture = false;
    bool specular_texture = false;
    bool specular_color_texture = false;
    bool clearcoat_texture = false;
    bool clearcoat_roughness_texture = false;
    bool clearcoat_normal_texture = false;
    bool transmission_texture = false;
    bool diffuse_transmission_texture = false;
    bool diffuse_transmission_color_texture = false;
    bool sheen_color_texture = false;
    bool sheen_roughness_texture = false;
    bool anisotropy_texture = false;
    bool iridescence_texture = false;
    bool iridescence_thickness_texture = false;

    bool operator==(const MaterialNeeds&) const = default;
};

/// Returns whether the material emits light by its emission factor; unlit materials do not.
bool has_emission(const Material& material);

}  // namespace halflight
