// The BSDF of shaders/SHADING.md at one vertex, for one outgoing direction.
#include "shaders/lib/microfacet.glsl"
#include "shaders/lib/onb.glsl"
#include "shaders/lib/sampling.glsl"

// The material for one wo. All factors that depend on wo alone are included: Fresnel, multiple scattering, coat.
struct Bsdf {
    vec3 geometric_normal;  // n_g
    float p_diffuse;        // probability P_d of the diffuse component; the glossy component has 1 - P_d
    vec3 normal;            // n
    float alpha;            // roughness of specular and transmission; 0: mirror
    vec3 diffuse;           // albedo of the diffuse lobe
    float p_transmission;   // probability of transmission among the glossy lobes
    vec3 specular;          // the lobe is D G2 / (4 mu_o mu_i) (specular + specular_edge (1 - x)^5)
    float p_coat;           // probability of the coat among the glossy lobes
    vec3 specular_edge;
    float coat_alpha;       // roughness of the coat; 0: mirror
    vec3 transmission;      // factor of the mirrored D G2 / (4 mu_o mu_i)
    float coat;             // factor of D G2 / (4 mu mu_i) F(0.04, 1, x)
    vec3 coat_normal;       // n_k
};

const float kCoatF0 = 0.04;

// Returns the gain M of a lobe for the energy lost to multiple scattering (Turquin 2019, eq. 16).
vec3 multiple_scattering_gain(vec3 f0, float albedo) { return 1.0 + f0 * ((1.0 - albedo) / albedo); }

// Returns the component that a uniform number selects; a constant where the scene has only one.
bool picks_diffuse(Bsdf b, float choice) {
#ifndef HALFLIGHT_DIFFUSE
    return false;
#elif !defined(HALFLIGHT_GLOSSY)
    return true;
#else
    return choice < b.p_diffuse;
#endif
}

// Returns the probability of the specular lobe among the glossy lobes.
float p_specular(Bsdf b) { return max(1.0 - b.p_transmission - b.p_coat, 0.0); }

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
#ifdef HALFLIGHT_DIFFUSE
    value.pdf_diffuse = reflected ? side_n * 0.318309886184 : 0.0;
    value.diffuse = b.diffuse * value.pdf_diffuse;
#endif
    value.glossy = vec3(0.0);
    value.pdf_glossy = 0.0;
#ifdef HALFLIGHT_GLOSSY
    bool lobe = reflected;
    vec3 scale = b.specular;
    vec3 edge = b.specular_edge;
    float p = p_specular(b);
    vec3 folded = wi;
#ifdef HALFLIGHT_TRANSMISSION
    bool transmitted = side_g < 0.0 && side_n < 0.0;
    lobe = lobe || transmitted;
    scale = transmitted ? b.transmission : scale;
    edge = transmitted ? vec3(0.0) : edge;
    p = transmitted ? b.p_transmission : p;
    folded = transmitted ? wi - 2.0 * side_n * b.normal : wi;
#endif
    if (lobe && b.alpha > 0.0) {
        GgxValue ggx = ggx_evaluate(b.normal, b.alpha, wo, folded);
        value.glossy = ggx.scattered * (scale + edge * ggx.schlick);
        value.pdf_glossy = p * ggx.pdf;
    }
#ifdef HALFLIGHT_CLEARCOAT
    if (b.coat > 0.0 && b.coat_alpha > 0.0 && side_g > 0.0 && dot(b.coat_normal, wi) > 0.0) {
        GgxValue ggx = ggx_evaluate(b.coat_normal, b.coat_alpha, wo, wi);
        value.glossy += vec3(ggx.scattered * b.coat * mix(ggx.schlick, 1.0, kCoatF0));
        value.pdf_glossy += b.p_coat * ggx.pdf;
    }
#endif
#endif
    return value;
}

struct BsdfSample {
    vec3 direction;  // unit length
    float pdf;       // density, conditional on the component; 0: mirror direction, or no sample
    vec3 weight;     // value |cosine| / pdf, conditional on the component; 0: the path ends
};

BsdfSample sample_diffuse(Bsdf b, vec3 wo, vec2 xi) {
    vec3 local = sample_cosine(xi);
    BsdfSample s;
    s.direction = basis_around(b.normal) * local;
    bool usable = local.z > 0.0 && dot(s.direction, b.geometric_normal) > 0.0;
    s.pdf = usable ? local.z * 0.318309886184 : 0.0;
    s.weight = usable ? b.diffuse : vec3(0.0);
    return s;
}

// Samples a glossy direction. `choice`, uniform in [0, 1), selects specular, transmission or coat.
BsdfSample sample_glossy(Bsdf b, vec3 wo, vec2 xi, float choice) {
    bool coat = false;
    bool transmitted = false;
    vec3 n = b.normal;
    float alpha = b.alpha;
    float p = p_specular(b);
#ifdef HALFLIGHT_CLEARCOAT
    coat = choice < b.p_coat;
    n = coat ? b.coat_normal : n;
    alpha = coat ? b.coat_alpha : alpha;
    p = coat ? b.p_coat : p;
#endif
#ifdef HALFLIGHT_TRANSMISSION
    transmitted = !coat && choice < b.p_coat + b.p_transmission;
    p = transmitted ? b.p_transmission : p;
#endif
    bool mirror = alpha == 0.0;
    mat3 basis = basis_around(n);
    vec3 wo_local = wo * basis;
    wo_local.z = max(wo_local.z, 1e-20);  // bent normals face wo; the bound covers rounding of the product
    vec3 h = mirror ? vec3(0.0, 0.0, 1.0) : sample_visible_normal(wo_local, alpha, xi);
    float x = dot(wo_local, h);
    vec3 local = 2.0 * x * h - wo_local;
    bool usable = local.z > 0.0;
    local.z = transmitted ? -local.z : local.z;
    vec3 wi = normalize(basis * local);
    float side_g = dot(wi, b.geometric_normal);
    usable = usable && (transmitted ? side_g < 0.0 : side_g > 0.0);

    BsdfSample s;
    s.direction = wi;
    BsdfValue value = evaluate_bsdf(b, wo, wi);
    s.pdf = usable ? value.pdf_glossy : 0.0;
    s.weight = s.pdf > 0.0 ? value.glossy / s.pdf : vec3(0.0);
    if (mirror) {
        float schlick = pow5(1.0 - clamp(x, 0.0, 1.0));
        vec3 reflectance = coat          ? vec3(b.coat * mix(schlick, 1.0, kCoatF0))
                           : transmitted ? b.transmission
                                         : b.specular + b.specular_edge * schlick;
        s.pdf = 0.0;
        s.weight = usable && p > 0.0 ? reflectance / p : vec3(0.0);
    }
    return s;
}
