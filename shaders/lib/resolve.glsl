// Conversion of a hit to the content of a surface record (shaders/lib/surface_record.glsl). Needs
// shaders/geometry_tables.glsl and shaders/scene_tables.glsl. Kernels that shade read records instead.
#include "shaders/lib/bsdf.glsl"
#include "shaders/lib/material.glsl"

float average(vec3 c) { return (c.r + c.g + c.b) * (1.0 / 3.0); }

float ggx_alpha(float roughness) {
    float alpha = roughness * roughness;
    return alpha < kMirrorAlpha ? 0.0 : alpha;
}

// Folds the factors that depend on wo alone into the BSDF at a surface.
Bsdf make_bsdf(Material m, vec3 geometric_normal, vec3 wo) {
    precise Bsdf b;  // precise: code of lobes that the material lacks must not change bits of others
    b.geometric_normal = geometric_normal;
    b.normal = m.normal;
    b.coat_normal = m.coat_normal;
    b.alpha = 0.0;
    b.specular = vec3(0.0);
    b.specular_edge = vec3(0.0);
    b.transmission = vec3(0.0);
    b.coat = 0.0;
    b.coat_alpha = 0.0;
    b.p_diffuse = 1.0;
    b.p_transmission = 0.0;
    b.p_coat = 0.0;
    b.diffuse = (1.0 - m.metallic) * m.base_color;
#ifdef HALFLIGHT_GLOSSY
    b.alpha = ggx_alpha(m.roughness);
    vec2 albedo = ggx_albedo(dot(m.normal, wo), b.alpha);
    float whole = albedo.x + albedo.y;  // E_1
    vec3 f0 = min(m.dielectric_f0 * m.specular_color, vec3(1.0)) * m.specular;
    vec3 gain = (1.0 - m.metallic) * multiple_scattering_gain(f0, whole);
    vec3 metal_gain = m.metallic * multiple_scattering_gain(m.base_color, whole);
    b.specular = metal_gain * m.base_color + gain * f0;
    b.specular_edge = metal_gain * (1.0 - m.base_color) + gain * (m.specular - f0);

    vec3 reflected = multiple_scattering_gain(f0, whole) * (f0 * albedo.x + m.specular * albedo.y);
    b.diffuse *= 1.0 - min(max(reflected.r, max(reflected.g, reflected.b)), 1.0);
    float coat_albedo = 0.0;
#ifdef HALFLIGHT_CLEARCOAT
    b.coat_alpha = ggx_alpha(m.coat_roughness);
    vec2 e_k = ggx_albedo(dot(m.coat_normal, wo), b.coat_alpha);
    b.coat = m.coat * multiple_scattering_gain(vec3(kCoatF0), e_k.x + e_k.y).x;
    coat_albedo = b.coat * (kCoatF0 * e_k.x + e_k.y);
    b.diffuse *= 1.0 - coat_albedo;
    b.specular *= 1.0 - coat_albedo;
    b.specular_edge *= 1.0 - coat_albedo;
#endif
    float transmission = 0.0;
#ifdef HALFLIGHT_TRANSMISSION
    b.transmission = b.diffuse * (m.transmission / whole);
    b.diffuse *= 1.0 - m.transmission;
    transmission = average(b.transmission) * whole;
#endif
    float diffuse = average(b.diffuse);
    float specular = average(b.specular * whole + b.specular_edge * albedo.y);
    float glossy = specular + transmission + coat_albedo;
    float sum = diffuse + glossy;
    b.p_diffuse = glossy > 0.0 ? diffuse / sum : 1.0;  // a black surface may pick either component
    b.p_transmission = glossy > 0.0 ? transmission / glossy : 0.0;
    b.p_coat = glossy > 0.0 ? coat_albedo / glossy : 0.0;
#endif
#ifndef HALFLIGHT_DIFFUSE
    b.p_diffuse = 0.0;
#endif
    return b;
}
