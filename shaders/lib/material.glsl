// Evaluation of the material at a surface (SHADING.md, Surfaces and BSDF). Needs shaders/scene_tables.glsl.
#include "shaders/lib/lobes.glsl"
#include "shaders/lib/material_properties.glsl"
#include "shaders/lib/surface.glsl"

#define HALFLIGHT_MATERIAL 1  // shaders/lib/bsdf.glsl makes a BSDF from a material

// Bends a normal that faces away from wo towards it (SHADING.md, Surfaces).
vec3 bend_normal(vec3 n, vec3 wo) {
    float cosine = dot(n, wo);
    return cosine <= 0.0 ? normalize(n + wo * (1e-3 - cosine)) : n;
}

vec3 mapped_normal(Surface s, uint slot, float scale) {
    if (!kNormalMaps) return s.normal;
    vec3 texel = 2.0 * data_texture(slot, s.uv0, s.uv1).xyz - 1.0;
    vec3 bitangent = cross(s.normal, s.tangent.xyz) * s.tangent.w;
    vec3 n = scale * texel.x * s.tangent.xyz + scale * texel.y * bitangent + texel.z * s.normal;
    float length_squared = dot(n, n);
    bool usable = slot != kNoTexture && s.tangent.w != 0.0 && length_squared > 0.0;
    return usable ? n * inversesqrt(length_squared) : s.normal;
}

// Finds the direction of higher roughness, perpendicular to the bent normal (SHADING.md, Anisotropy).
void find_rough_direction(inout Material m, Surface s) {
    vec2 direction = vec2(1.0, 0.0);
    if (HALFLIGHT_TEXTURE_ANISOTROPY != 0) {
        uint slot = anisotropy_texture_slot(s.material);
        vec3 texel = data_texture(slot, s.uv0, s.uv1).rgb;
        direction = slot != kNoTexture ? 2.0 * texel.rg - 1.0 : direction;
        m.anisotropy *= texel.b;
    }
    float c = cos(m.anisotropy_rotation);
    float d = sin(m.anisotropy_rotation);
    direction = vec2(c * direction.x - d * direction.y, d * direction.x + c * direction.y);
    vec3 along = direction.x * s.tangent.xyz + direction.y * s.tangent.w * cross(s.normal, s.tangent.xyz);
    along -= dot(along, m.normal) * m.normal;
    float length_squared = dot(along, along);
    bool usable = s.tangent.w != 0.0 && length_squared > 1e-8;
    m.rough_direction = usable ? along * inversesqrt(length_squared) : vec3(0.0);
    m.anisotropy = usable ? m.anisotropy : 0.0;
}

// Returns the material with textures, vertex colours and normal maps applied. `wo` has unit length and points from the
// surface to the origin of the ray.
Material evaluate_material(Surface s, vec3 wo) {
    Material m = load_material(s.material);
    if (kVertexColors) m.base_color *= s.color.rgb;
    if (kTextures) multiply_textures(m, s.material, s.uv0, s.uv1);
    m.normal = s.normal;
    m.coat_normal = s.normal;
    if (HALFLIGHT_TEXTURE_NORMAL != 0) m.normal = mapped_normal(s, normal_texture_slot(s.material), m.normal_scale);
    if (HALFLIGHT_TEXTURE_CLEARCOAT_NORMAL != 0)
        m.coat_normal = mapped_normal(s, clearcoat_normal_texture_slot(s.material), m.coat_normal_scale);
    m.front = s.front;
    m.bent = dot(m.normal, wo) <= 0.0 || (m.coat > 0.0 && dot(m.coat_normal, wo) <= 0.0);
    m.normal = bend_normal(m.normal, wo);
    m.coat_normal = bend_normal(m.coat_normal, wo);
    m.rough_direction = vec3(0.0);
    if (kAnisotropy) find_rough_direction(m, s);
    if (m.unlit) {  // every property that scales a lobe is packed as 0
        m.emission = m.base_color;
        m.base_color = vec3(0.0);
    }
    return m;
}
