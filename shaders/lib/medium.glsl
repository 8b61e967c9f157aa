// The inside of solids, and how light enters and leaves it (SHADING.md, Solids).
#include "shaders/lib/bsdf_record.glsl"
#include "shaders/lib/microfacet.glsl"

// A medium is the absorption per world unit on a ray's way, and the length L that stands for an endless way. The length
// is 0 outside of solids. Its sign bit is set for paths of one colour channel.
float endless_way(vec4 medium) { return abs(medium.w); }
bool is_one_channel(vec4 medium) { return (floatBitsToUint(medium.w) & 0x80000000u) != 0u; }

// Returns the factor of light that a path has from a surface that disperses it. `channel`: the path's colour channel.
// Each is picked with probability 1/3, and counts once.
vec3 dispersed_light(vec4 medium, int channel) {
    return (is_one_channel(medium) ? 1.0 : 3.0) * vec3(equal(ivec3(channel), ivec3(0, 1, 2)));
}

// Returns whether a direction from the surface leads to the inside of its solid.
bool leads_inside(Bsdf b, vec3 direction) {
    return b.eta > 0.0 && (dot(b.geometric_normal, direction) < 0.0) != (b.thickness < 0.0);
}

// Returns the medium of rays that leave the surface. `before` is that of the ray that arrived.
vec4 medium_towards(Bsdf b, vec4 before, vec3 direction) {
    bool leaves = b.thickness < 0.0 && dot(b.geometric_normal, direction) < 0.0;
    vec4 outside = leaves ? vec4(0.0) : vec4(before.rgb, endless_way(before));
    vec4 medium = leads_inside(b, direction) ? vec4(b.absorption, abs(b.thickness)) : outside;
    if (b.disperses || is_one_channel(before)) medium.w = uintBitsToFloat(floatBitsToUint(medium.w) | 0x80000000u);
    return medium;
}

// Returns the transmittance of a distance (Beer-Lambert). It is 0 if a float has no bits for it.
vec3 transmittance(vec4 medium, float distance) {
    return endless_way(medium) > 0.0 ? exp(-min(medium.rgb * distance, vec3(100.0))) : vec3(1.0);
}

// Returns whether reflection and refraction are perfect. Directions of nearly equal indices spread as little as those
// of nearly no roughness.
bool is_solid_mirror(Bsdf b) { return b.alpha_across * abs(b.eta - 1.0) < kMirrorAlpha; }

// Returns the share of light that a microfacet reflects at x = dot(wo, h). It refracts the rest.
float solid_fresnel(Bsdf b, float x) { return b.solid_specular * fresnel_dielectric(x, b.eta); }
