// Isotropic GGX (Trowbridge-Reitz) with the height-correlated Smith term; alpha in [1e-4, 1].
#include "shaders/shared/albedo.h"

float pow5(float v) { return v * v * v * v * v; }

// Returns D; `cross_squared` = |h x n|^2 keeps its precision where cos(h, n) is rounded to 1.
float ggx_density(float cosine, float cross_squared, float alpha) {
    float a2 = alpha * alpha;
    float k = cross_squared / a2 + cosine * cosine;
    return 0.318309886184 / (a2 * k * k);
}

// Returns sqrt(alpha^2 + (1 - alpha^2) cos^2) of Lambda = (L / cos - 1) / 2 (Heitz 2014, eq. 72).
float ggx_root(float cosine, float alpha) {
    float a2 = alpha * alpha;
    return sqrt(a2 + (1.0 - a2) * cosine * cosine);
}

// Value of one lobe in one direction, for reflection and mirrored transmission.
struct GgxValue {
    float scattered;  // D G2 / (4 mu_o mu_i), times mu_i
    float pdf;        // density of visible-normal sampling, per solid angle
    float schlick;    // (1 - dot(wo, h))^5
};

// Evaluates a lobe. wo, wi: unit length, dot(n, wi) > 0. G2 and pdf use forms in which the cosines cancel: no 0 / 0.
GgxValue ggx_evaluate(vec3 n, float alpha, vec3 wo, vec3 wi) {
    vec3 sum = wo + wi;
    vec3 h = sum * inversesqrt(max(dot(sum, sum), 1e-30));  // opposite grazing directions have no half vector; D ~ 0
    vec3 across = cross(h, n);
    float density = ggx_density(dot(h, n), dot(across, across), alpha);
    float mu_o = max(dot(n, wo), 0.0);  // n is bent towards wo, except for rounding
    float mu_i = dot(n, wi);
    float root_o = ggx_root(mu_o, alpha);
    float root_i = ggx_root(mu_i, alpha);
    GgxValue value;
    value.scattered = 0.5 * density / (mu_o * root_i / mu_i + root_o);
    value.pdf = 0.5 * density / (mu_o + root_o);
    value.schlick = pow5(1.0 - clamp(dot(wo, h), 0.0, 1.0));
    return value;
}

// Samples a visible normal of the lobe around +z (Dupuy and Benyoub 2023, Sampling Visible GGX Normals with Spherical
// Caps). Precondition: wo.z > 0.
vec3 sample_visible_normal(vec3 wo, float alpha, vec2 xi) {
    vec3 stretched = normalize(vec3(alpha * wo.xy, wo.z));
    float z = (1.0 - xi.y) * (1.0 + stretched.z) - stretched.z;
    float sine = sqrt(max(0.0, (1.0 - z) * (1.0 + z)));
    float phi = 6.28318530718 * xi.x;
    vec3 h = vec3(sine * cos(phi), sine * sin(phi), z) + stretched;
    // h.z >= 0 up to rounding; the minimum keeps a normal where h has cancelled completely.
    return normalize(vec3(alpha * h.xy, max(h.z, 1e-20)));
}

// Returns the directional albedo of the lobe (SHADING.md): x = E_A, y = E_B. engine/tables/albedo.h describes the
// table.
vec2 ggx_albedo(float cosine, float alpha) {
    float mu = clamp(cosine, 0.0, 1.0);
    float mirror = pow5(1.0 - mu);
    if (alpha < kMirrorAlpha) return vec2(1.0 - mirror, mirror);
    vec2 at = albedo_coordinates(mu, alpha) * float(kAlbedoTableSize - 1);
    vec2 cell = clamp(floor(at), 0.0, float(kAlbedoTableSize - 2));
    vec2 f = at - cell;
    ivec2 c = ivec2(cell);
    vec2 low = mix(texelFetch(albedo_table, c, 0).rg, texelFetch(albedo_table, c + ivec2(1, 0), 0).rg, f.x);
    ++c.y;
    vec2 high = mix(texelFetch(albedo_table, c, 0).rg, texelFetch(albedo_table, c + ivec2(1, 0), 0).rg, f.x);
    vec2 entry = mix(low, high, f.y);
    float edge = entry.x * clamp(mirror + entry.y, 0.0, 1.0);
    return vec2(entry.x - edge, edge);
}
