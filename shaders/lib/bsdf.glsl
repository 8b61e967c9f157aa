// The BSDF of shaders/SHADING.md: evaluation and sampling. A BSDF is made from a material if shaders/lib/material.glsl
// is included before.
#include "shaders/lib/bsdf_record.glsl"
#include "shaders/lib/layers.glsl"
#include "shaders/lib/medium.glsl"
#if HALFLIGHT_MATERIAL  // shaders/lib/material.glsl is included
#include "shaders/lib/bsdf_of_material.glsl"
#endif
#include "shaders/lib/onb.glsl"
#include "shaders/lib/sampling.glsl"

// Returns the part of the specular lobe's factor that the film adds, at x = dot(wo, h).
vec3 film_reflection(Bsdf b, float x) {
    FilmWaves waves = film_waves(b.film_ior, b.film_thickness, x);
    return b.film_dielectric * film_reflectance(waves, b.film_dielectric_f0) +
           b.film_metal * film_reflectance(waves, b.film_metal_f0);
}

// Returns the normal of the specular lobe and of thin transmission. Solids keep n.
vec3 base_normal(Bsdf b, vec3 wo) {
    return !kGlossy || b.eta > 0.0 ? b.normal : reflecting_normal(b.normal, b.geometric_normal, wo);
}

// Returns the reflectance below the coat, with the Fresnel terms of normal incidence. The factors of rough lobes
// contain the gain for multiple scattering, so they are multiplied by the lobe's albedo. Only a film may exceed 1.
vec3 reflectance(Bsdf b, vec3 wo) {
    precise vec3 sum = b.diffuse;  // terms of lobes that no material has must not change bits
    if (kDiffuseTransmission) sum += b.diffuse_through;
    if (kGlossy) {
        vec3 n = base_normal(b, wo);
        vec2 albedo = ggx_albedo(ordered_dot(n, wo), b.alpha);
        if (kAnisotropy && b.alpha != b.alpha_across)
            albedo = ggx_albedo(wo * bent_basis(b.normal, b.rough_direction, n), vec2(b.alpha, b.alpha_across));
        float whole = b.alpha > 0.0 ? albedo.x + albedo.y : 1.0;
        sum += b.specular * whole + b.transmission * (b.eta > 0.0 ? 1.0 : whole);
        if (kIridescence) sum += film_reflection(b, 1.0) * whole;
    }
    return sum;
}

// Returns the component that a uniform number selects; a constant if the scene has only one.
bool picks_diffuse(Bsdf b, float choice) { return kDiffuse && (!kGlossy || choice < b.p_diffuse); }

// Returns the probability of the specular lobe among the glossy lobes.
float p_specular(Bsdf b) { return max(1.0 - b.p_transmission - b.p_coat - b.p_sheen, 0.0); }

// Value times |cosine| by component. Densities are conditional on the component. Mirror lobes have value 0.
struct BsdfValue {
    vec3 diffuse;
    float pdf_diffuse;
    vec3 glossy;
    float pdf_glossy;
};

BsdfValue evaluate_bsdf(Bsdf b, vec3 wo, vec3 wi) {
    float side_g = dot(b.geometric_normal, wi);
    float side_n = dot(b.normal, wi);
    bool reflected = side_g > 0.0 && side_n > 0.0;
    BsdfValue value;
    value.pdf_diffuse = 0.0;
    value.diffuse = vec3(0.0);
    if (kDiffuse) {
        value.pdf_diffuse = reflected ? side_n * 0.318309886184 : 0.0;
        value.diffuse = b.diffuse * value.pdf_diffuse;
    }
    if (kDiffuseTransmission) {
        bool passes = side_g < 0.0 && side_n < 0.0;
        float lambert = passes ? side_n * -0.318309886184 : value.pdf_diffuse;
        value.diffuse = (passes ? b.diffuse_through : b.diffuse) * lambert;
        value.pdf_diffuse = (passes ? b.p_through : 1.0 - b.p_through) * lambert;
    }
    value.glossy = vec3(0.0);
    value.pdf_glossy = 0.0;
    if (!kGlossy) return value;
    vec3 n = base_normal(b, wo);
    side_n = dot(n, wi);
    bool base_reflects = side_g > 0.0 && side_n > 0.0;
    bool lobe = base_reflects;
    vec3 scale = b.specular;
    vec3 edge = b.specular_edge;
    float p = p_specular(b);
    vec3 folded = wi;
    bool transmitted = kTransmission && b.eta == 0.0 && side_g < 0.0 && side_n < 0.0;
    if (kTransmission) {
        lobe = lobe || transmitted;
        scale = transmitted ? b.transmission : scale;
        edge = transmitted ? vec3(0.0) : edge;
        p = transmitted ? b.p_transmission : p;
        folded = transmitted ? wi - 2.0 * side_n * n : wi;
    }
    if (lobe && b.alpha > 0.0) {
        GgxValue ggx = ggx_evaluate(n, b.alpha, wo, folded);
        if (kAnisotropy && b.alpha != b.alpha_across)
            ggx = ggx_evaluate(bent_basis(b.normal, b.rough_direction, n), vec2(b.alpha, b.alpha_across), wo, folded);
        value.glossy = ggx.scattered * (scale + edge * ggx.schlick);
        if (kIridescence) value.glossy += ggx.scattered * (transmitted ? vec3(0.0) : film_reflection(b, ggx.x));
        value.pdf_glossy = p * ggx.pdf;
    }
    if (kVolume && b.eta > 0.0 && !is_solid_mirror(b)) {
        if (reflected) {
            GgxValue ggx = ggx_evaluate(b.normal, b.alpha_across, wo, wi);
            float fresnel = solid_fresnel(b, max(dot(wo, normalize(wo + wi)), 0.0));
            value.glossy += b.solid_reflection * (b.solid_gain * fresnel * ggx.scattered);
            value.pdf_glossy += b.p_transmission * fresnel * ggx.pdf;
        } else if (side_g < 0.0 && side_n < 0.0) {
            RefractedValue refracted = refracted_evaluate(b.normal, b.alpha_across, b.eta, wo, wi);
            float passed = 1.0 - solid_fresnel(b, refracted.x);
            value.glossy += b.transmission * (b.solid_gain * passed * refracted.scattered);
            value.pdf_glossy += b.p_transmission * passed * refracted.pdf;
        }
    }
    if (kClearcoat && b.coat > 0.0 && b.coat_alpha > 0.0 && side_g > 0.0 && dot(b.coat_normal, wi) > 0.0) {
        GgxValue ggx = ggx_evaluate(b.coat_normal, b.coat_alpha, wo, wi);
        value.glossy += vec3(ggx.scattered * b.coat * mix(ggx.schlick, 1.0, kCoatF0)) * b.coat_tint;
        value.pdf_glossy += b.p_coat * ggx.pdf;
    }
    if (kSheen && reflected && b.sheen != vec3(0.0)) {
        value.glossy += b.sheen * sheen_scattered(b.normal, b.sheen_alpha, wo, wi);
        value.pdf_glossy += b.p_sheen * sheen_pdf(dot(b.normal, wi), b.sheen_alpha);
    }
    return value;
}

struct BsdfSample {
    vec3 direction;  // unit length
    float pdf;       // density, conditional on the component; 0: mirror direction, or no sample
    vec3 weight;     // value |cosine| / pdf, conditional on the component; 0: the path ends
};

// Samples a diffuse direction. `choice`, uniform in [0, 1), selects reflection or transmission.
BsdfSample sample_diffuse(Bsdf b, vec3 wo, vec2 xi, float choice) {
    vec3 local = sample_cosine(xi);
    BsdfSample s;
    if (kDiffuseTransmission && choice < b.p_through) {
        s.direction = basis_around(b.normal) * -local;
        bool passes = local.z > 0.0 && dot(s.direction, b.geometric_normal) < 0.0;
        s.pdf = passes ? local.z * 0.318309886184 * b.p_through : 0.0;
        s.weight = passes ? b.diffuse_through / b.p_through : vec3(0.0);
        return s;
    }
    s.direction = basis_around(b.normal) * local;
    bool usable = local.z > 0.0 && dot(s.direction, b.geometric_normal) > 0.0;
    s.pdf = usable ? local.z * 0.318309886184 : 0.0;
    s.weight = usable ? b.diffuse : vec3(0.0);
    if (kDiffuseTransmission) {
        s.pdf *= 1.0 - b.p_through;
        s.weight /= 1.0 - b.p_through;
    }
    return s;
}

// Returns the direction that a microfacet reflects or refracts. `split`, uniform in [0, 1), decides which.
vec3 solid_direction(Bsdf b, vec3 wo, vec3 facet, float split, out bool refracted) {
    float x = dot(wo, facet);
    refracted = split >= solid_fresnel(b, clamp(x, 0.0, 1.0));
    return refracted ? refracted_direction(wo, facet, b.eta) : normalize(2.0 * x * facet - wo);
}

// Samples a glossy direction. `choice`, uniform in [0, 1), selects specular, transmission, coat or sheen.
BsdfSample sample_glossy(Bsdf b, vec3 wo, vec2 xi, float choice) {
    bool coat = kClearcoat && choice < b.p_coat;
    bool transmitted = kTransmission && !coat && choice < b.p_coat + b.p_transmission;
    bool sheen = kSheen && !coat && !transmitted && choice < b.p_coat + b.p_transmission + b.p_sheen;
    vec3 n = base_normal(b, wo);
    n = coat ? b.coat_normal : sheen ? b.normal : n;
    vec2 alpha = vec2(coat ? b.coat_alpha : b.alpha);
    float p = coat ? b.p_coat : transmitted ? b.p_transmission : p_specular(b);
    bool mirror = alpha.x == 0.0 && !sheen;
    mat3 basis = basis_around(n);
    if (kAnisotropy && !coat && b.alpha != b.alpha_across) {
        bool solid_lobe = transmitted && b.eta > 0.0;  // isotropic
        alpha = solid_lobe ? vec2(b.alpha_across) : vec2(b.alpha, b.alpha_across);
        basis = solid_lobe ? basis : bent_basis(b.normal, b.rough_direction, n);
    }
    vec3 wo_local = wo * basis;
    wo_local.z = max(wo_local.z, 1e-20);  // bent normals face wo; the bound covers rounding of the product
    vec3 h = mirror ? vec3(0.0, 0.0, 1.0) : sample_visible_normal(wo_local, alpha, xi);
    float x = dot(wo_local, h);
    vec3 local = 2.0 * x * h - wo_local;
    if (kSheen) local = sheen ? sample_sheen(b.sheen_alpha, xi) : local;
    bool usable = local.z > 0.0;
    local.z = transmitted ? -local.z : local.z;
    vec3 wi = normalize(basis * local);
    float side_g = dot(wi, b.geometric_normal);
    usable = usable && (transmitted ? side_g < 0.0 : side_g > 0.0);
    bool solid = kVolume && transmitted && b.eta > 0.0;
    bool solid_mirror = solid && is_solid_mirror(b);
    bool refracted = false;
    if (solid) {
        mirror = solid_mirror;
        float split = clamp((choice - b.p_coat) / b.p_transmission, 0.0, 1.0);
        vec3 facet = mirror ? n : basis * h;
        wi = solid_direction(b, wo, facet, split, refracted);
        // A mirror whose shading normal would send light to the wrong side of the surface uses the geometric normal.
        if (mirror && (dot(wi, b.geometric_normal) < 0.0) != refracted)
            wi = solid_direction(b, wo, b.geometric_normal, split, refracted);
        float away = refracted ? -1.0 : 1.0;
        usable = away * dot(wi, b.geometric_normal) > 0.0 && (mirror || away * dot(wi, n) > 0.0);
    }

    BsdfSample s;
    s.direction = wi;
    BsdfValue value = evaluate_bsdf(b, wo, wi);
    s.pdf = usable ? value.pdf_glossy : 0.0;
    s.weight = s.pdf > 0.0 ? value.glossy / s.pdf : vec3(0.0);
    if (solid_mirror) {
        s.pdf = 0.0;
        s.weight = usable && p > 0.0 ? (refracted ? b.transmission : b.solid_reflection) / p : vec3(0.0);
        return s;
    }
    if (mirror) {
        float schlick = pow5(1.0 - clamp(x, 0.0, 1.0));
        vec3 reflectance = coat          ? vec3(b.coat * mix(schlick, 1.0, kCoatF0)) * b.coat_tint
                           : transmitted ? b.transmission
                                         : b.specular + b.specular_edge * schlick;
        if (kIridescence && !coat && !transmitted) reflectance += film_reflection(b, x);
        s.pdf = 0.0;
        s.weight = usable && p > 0.0 ? reflectance / p : vec3(0.0);
    }
    return s;
}
