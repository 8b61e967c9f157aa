// Alpha coverage (SHADING.md, Surfaces). Needs shaders/geometry_tables.glsl
// and shaders/scene_tables.glsl.
#include "shaders/lib/sobol.glsl"
#include "shaders/lib/material_properties.glsl"
#include "shaders/lib/vertex.glsl"
#include "shaders/shared/material_rows.h"

struct Coverage {
    float alpha;
    float cutoff;  // alpha cutoff, or kAlphaBlend; 0: opaque
};

const bool kAlpha = HALFLIGHT_ALPHA != 0;  // some material is not opaque

// Returns the coverage at a point; u and v are the weights of the triangle's second and third corner. `row`: its place
// in the tables.
Coverage coverage_at(uint row, float u, float v) {
    uvec4 t = triangle_row(row);
    uint material = t.w & 0x00ffffffu;
    Coverage c;
    c.alpha = packed_base_color(material).a;
    c.cutoff = packed_alpha_cutoff(material);
    vec3 weights = vec3(1.0 - u - v, u, v);
    if (HALFLIGHT_TEXTURE_BASE_COLOR != 0) {
        vec4 uvs = interpolate_uvs(t.xyz, weights);
        c.alpha *= color_texture(base_color_texture_slot(material), uvs.xy, uvs.zw).a;
    }
    if (kVertexColors) c.alpha *= interpolate_color(t.xyz, weights).a;
    return c;
}

// Returns whether a ray that meets the triangle at barycentrics (u, v) hits it, independently of earlier hits. Opaque
// triangles accept all rays. Blend accepts u < alpha, u in [0, 1): alpha 1 always, 0 never. Each triangle is a dimension
// of `random`, an alpha_sampler_of_path(): triangles are independent, and at each of them the samples of a pixel are
// stratified. `row`: the triangle's place in the tables; in scenes that are loaded in pages they hold few triangles.
bool alpha_accept(uint triangle, uint row, uint instance, float u, float v, Sampler random) {
    if (!kAlpha) return true;
    Coverage c = coverage_at(row, u, v);
    bool blend = c.cutoff == kAlphaBlend;
    float number = sample_1d(random, hash_combine(instance, triangle));
    return blend ? number < c.alpha : c.alpha >= c.cutoff;
}

// Returns the expected share of rays for which alpha_accept is true, for light points picked on such a triangle.
float alpha_share(uint row, float u, float v) {
    if (!kAlpha) return 1.0;
    Coverage c = coverage_at(row, u, v);
    return c.cutoff == kAlphaBlend ? clamp(c.alpha, 0.0, 1.0) : (c.alpha >= c.cutoff ? 1.0 : 0.0);
}
