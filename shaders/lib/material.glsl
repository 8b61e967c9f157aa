// Material parameters at a surface (SHADING.md, Surfaces and BSDF). Needs shaders/scene_tables.glsl.
#include "shaders/lib/surface.glsl"
#include "shaders/lib/texture.glsl"
#include "shaders/shared/material.h"
#include "shaders/shared/word.h"

// Extensions that no material of the scene has are constants here, which the compiler folds away.
struct Material {
    vec3 base_color;
    float metallic;
    vec3 emission;  // radiance; of unlit materials, which have everything else 0, the base colour
    float roughness;
    vec3 normal;    // n: normal-mapped, on the side of n_g, bent towards wo
    float specular;
    vec3 specular_color;
    float dielectric_f0;  // ((ior - 1) / (ior + 1))^2
    vec3 coat_normal;     // n_k
    float coat;
    float coat_roughness;
    float transmission;
    bool bent;  // wo does not see n as it was, or n_k where there is a coat
};

vec4 material_row(uint material, int texel) {
    return texelFetch(scene_materials, int(material) * kMaterialStride + texel);
}

// SHADING.md: a normal that wo does not see is bent towards it.
vec3 bend_normal(vec3 n, vec3 wo) {
    float cosine = dot(n, wo);
    return cosine <= 0.0 ? normalize(n + wo * (1e-3 - cosine)) : n;
}

vec3 mapped_normal(Surface s, uint slot, float scale) {
#ifdef HALFLIGHT_NORMAL_MAPS
    vec3 texel = 2.0 * data_texture(slot, s.uv0, s.uv1).xyz - 1.0;
    vec3 bitangent = cross(s.normal, s.tangent.xyz) * s.tangent.w;
    vec3 n = scale * texel.x * s.tangent.xyz + scale * texel.y * bitangent + texel.z * s.normal;
    float length_squared = dot(n, n);
    bool usable = slot != kNoTexture && s.tangent.w != 0.0 && length_squared > 0.0;
    return usable ? n * inversesqrt(length_squared) : s.normal;
#else
    return s.normal;
#endif
}

// wo: unit, from the surface to where the ray came from.
Material evaluate_material(Surface s, vec3 wo) {
    vec4 base = material_row(s.material, 0);
    vec4 lobe = material_row(s.material, 2);
    Material m;
    m.base_color = base.rgb;
    m.emission = vec3(0.0);
#ifdef HALFLIGHT_EMISSION
    vec4 emission_unlit = material_row(s.material, 1);
    m.emission = emission_unlit.rgb;
#endif
    m.metallic = lobe.x;
    m.roughness = lobe.y;
    m.specular = lobe.z;
    m.dielectric_f0 = lobe.w;
    m.specular_color = vec3(1.0);
    m.transmission = 0.0;
    m.coat = 0.0;
    m.coat_roughness = 0.0;
#if defined(HALFLIGHT_SPECULAR_COLOR) || defined(HALFLIGHT_TRANSMISSION)
    vec4 color_transmission = material_row(s.material, 3);
#endif
#ifdef HALFLIGHT_SPECULAR_COLOR
    m.specular_color = color_transmission.rgb;
#endif
#ifdef HALFLIGHT_TRANSMISSION
    m.transmission = color_transmission.a;
#endif
#if defined(HALFLIGHT_CLEARCOAT) || defined(HALFLIGHT_NORMAL_MAPS)
    vec4 coat_scales = material_row(s.material, 4);
#endif
#ifdef HALFLIGHT_CLEARCOAT
    m.coat = coat_scales.x;
    m.coat_roughness = coat_scales.y;
#endif
#ifdef HALFLIGHT_VERTEX_COLORS
    m.base_color *= s.color.rgb;
#endif
    m.normal = s.normal;
    m.coat_normal = s.normal;
#ifdef HALFLIGHT_TEXTURES
    uvec4 slots = words_of_floats(material_row(s.material, 5));
#ifdef HALFLIGHT_TEXTURE_BASE_COLOR
    m.base_color *= color_texture(slots.y, s.uv0, s.uv1).rgb;
#endif
#ifdef HALFLIGHT_TEXTURE_METALLIC_ROUGHNESS
    vec2 roughness_metallic = data_texture(slots.z, s.uv0, s.uv1).gb;
    m.roughness *= roughness_metallic.x;
    m.metallic *= roughness_metallic.y;
#endif
#ifdef HALFLIGHT_TEXTURE_NORMAL
    m.normal = mapped_normal(s, slots.w, coat_scales.z);
#endif
#if defined(HALFLIGHT_TEXTURE_EMISSION) || defined(HALFLIGHT_TEXTURE_SPECULAR) || \
    defined(HALFLIGHT_TEXTURE_SPECULAR_COLOR) || defined(HALFLIGHT_TEXTURE_TRANSMISSION)
    uvec4 more_slots = words_of_floats(material_row(s.material, 6));
#endif
#ifdef HALFLIGHT_TEXTURE_EMISSION
    m.emission *= color_texture(more_slots.x, s.uv0, s.uv1).rgb;
#endif
#ifdef HALFLIGHT_TEXTURE_SPECULAR
    m.specular *= data_texture(more_slots.y, s.uv0, s.uv1).a;
#endif
#ifdef HALFLIGHT_TEXTURE_SPECULAR_COLOR
    m.specular_color *= color_texture(more_slots.z, s.uv0, s.uv1).rgb;
#endif
#ifdef HALFLIGHT_TEXTURE_TRANSMISSION
    m.transmission *= data_texture(more_slots.w, s.uv0, s.uv1).r;
#endif
#ifdef HALFLIGHT_CLEARCOAT
    uvec4 coat_slots = words_of_floats(material_row(s.material, 7));
#ifdef HALFLIGHT_TEXTURE_CLEARCOAT
    m.coat *= data_texture(coat_slots.x, s.uv0, s.uv1).r;
#endif
#ifdef HALFLIGHT_TEXTURE_CLEARCOAT_ROUGHNESS
    m.coat_roughness *= data_texture(coat_slots.y, s.uv0, s.uv1).g;
#endif
#ifdef HALFLIGHT_TEXTURE_CLEARCOAT_NORMAL
    m.coat_normal = mapped_normal(s, coat_slots.z, coat_scales.w);
#endif
#endif
#endif
    m.bent = dot(m.normal, wo) <= 0.0 || (m.coat > 0.0 && dot(m.coat_normal, wo) <= 0.0);
    m.normal = bend_normal(m.normal, wo);
    m.coat_normal = bend_normal(m.coat_normal, wo);
#ifdef HALFLIGHT_UNLIT
    if (emission_unlit.w != 0.0) {
        m.emission = m.base_color;
        m.base_color = vec3(0.0);
        m.metallic = 0.0;
        m.specular = 0.0;
        m.transmission = 0.0;
        m.coat = 0.0;
    }
#endif
    return m;
}
