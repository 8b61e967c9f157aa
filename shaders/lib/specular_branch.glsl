// The branch by which a specular chain leaves a surface. Include after shaders/lib/bsdf.glsl.
#include "shaders/lib/luminance.glsl"
#include "shaders/shared/chain_records.h"

struct SpecularBranch {
    vec3 direction;  // unit length
    vec3 weight;     // share of the light from `direction` that is reflected or transmitted; 0: the chain ends here
    vec3 rest;       // reflectance of all other lobes
    vec3 facet;      // normal of the mirror; 0 if light passes
};

// Returns the strongest branch of a surface, which has to outweigh all others together. xi: the numbers by which the
// path samples its microfacet. others: reflectance of the lobes that are not glossy.
SpecularBranch specular_branch(Bsdf b, vec3 wo, vec2 xi, vec3 others) {
    SpecularBranch s = SpecularBranch(vec3(0.0, 0.0, 1.0), vec3(0.0), others, vec3(0.0));
    if (!kGlossy) return s;
    const float most_alpha = kMostSharpRoughness * kMostSharpRoughness;
    vec3 n = base_normal(b, wo);
    float alpha = max(b.alpha, b.alpha_across);
    float x = clamp(dot(n, wo), 0.0, 1.0);
    vec3 base = b.specular + b.specular_edge * pow5(1.0 - x);
    if (kIridescence) base += film_reflection(b, x);
    vec3 passed = kTransmission ? b.transmission : vec3(0.0);
    if (kVolume) {
        float fresnel = b.eta > 0.0 ? solid_fresnel(b, x) : 0.0;
        base += fresnel * b.solid_reflection;
        passed *= 1.0 - fresnel;
    }
    vec3 coat = vec3(0.0);
    vec3 mirrored = alpha <= most_alpha ? base : vec3(0.0);
    if (kClearcoat) {
        float coat_schlick = pow5(1.0 - clamp(dot(b.coat_normal, wo), 0.0, 1.0));
        coat = b.coat * mix(coat_schlick, 1.0, kCoatF0) * b.coat_tint;
        if (b.coat_alpha <= most_alpha) {
            bool is_coat = luminance_of(coat) > luminance_of(mirrored);
            n = is_coat ? b.coat_normal : n;
            alpha = is_coat ? b.coat_alpha : alpha;
            mirrored += coat;
        }
    }
    s.rest += base + passed + coat;
    bool passes = alpha <= most_alpha && luminance_of(passed) > luminance_of(mirrored);
    vec3 weight = passes ? passed : mirrored;
    bool follows = luminance_of(weight) > 0.0 && luminance_of(weight) >= 0.5 * luminance_of(s.rest) && !b.disperses;

    mat3 basis = basis_around(n);
    vec3 local = wo * basis;
    local.z = max(local.z, 1e-20);
    vec3 h = alpha > 0.0 ? basis * sample_visible_normal(local, vec2(alpha), xi) : n;
    vec3 wi = normalize(2.0 * dot(wo, h) * h - wo);
    s.facet = passes ? vec3(0.0) : h;
    if (passes && b.eta == 0.0) wi -= 2.0 * dot(wi, n) * n;
    if (kVolume && b.eta > 0.0) {
        // Shading normals that would send light to the wrong side are replaced, like in sample_glossy().
        float side = passes ? -1.0 : 1.0;
        if (passes) wi = refracted_direction(wo, h, b.eta);
        if (side * dot(wi, b.geometric_normal) <= 0.0) {
            h = b.geometric_normal;
            wi = passes ? refracted_direction(wo, h, b.eta) : normalize(2.0 * dot(wo, h) * h - wo);
        }
        follows = follows && !(passes && fresnel_dielectric(clamp(dot(wo, h), 0.0, 1.0), b.eta) >= 1.0);
    }
    follows = follows && (passes ? -1.0 : 1.0) * dot(wi, b.geometric_normal) > 0.0;
    s.direction = wi;
    s.weight = follows ? weight : vec3(0.0);
    s.rest = max(s.rest - s.weight, vec3(0.0));
    return s;
}
