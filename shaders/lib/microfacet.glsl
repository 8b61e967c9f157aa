// GGX (Trowbridge-Reitz) with the height-correlated Smith term, alpha in [1e-4, 1], solid transmission, and the sheen's
// lobe.
#include "shaders/lib/lobes.glsl"
#include "shaders/shared/albedo_coordinates.h"

// First rows of the parts of the albedo table (engine/tables/albedo.h).
const int kAnisotropyRow = (kSheen ? 2 : 1) * kAlbedoTableSize;
const int kSolidTableRow = kAnisotropyRow + (kAnisotropy ? kAnisotropyTableRows : 0);

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
    float x;          // dot(wo, h), in [0, 1]
    float schlick;    // (1 - x)^5
};

// Evaluates a lobe. wo, wi: unit length, dot(n, wi) > 0. G2 and pdf use forms in which the cosines cancel: no 0 / 0.
GgxValue ggx_evaluate(vec3 n, float alpha, vec3 wo, vec3 wi) {
    vec3 sum = wo + wi;
    vec3 h = sum * inversesqrt(max(dot(sum, sum), 1e-30));  // opposite grazing directions have no half vector; D ~ 0
    vec3 across = cross(h, n);
    float density = ggx_density(dot(h, n), dot(across, across), alpha);
    float mu_o = max(dot(n, wo), 0.0);  // n is bent towards wo, except for rounding
    float mu_i = max(dot(n, wi), 1e-20);  // a direction that was folded at the horizon may have 0 or less
    float root_o = ggx_root(mu_o, alpha);
    float root_i = ggx_root(mu_i, alpha);
    GgxValue value;
    value.scattered = 0.5 * density / (mu_o * root_i / mu_i + root_o);
    value.pdf = 0.5 * density / (mu_o + root_o);
    value.x = clamp(dot(wo, h), 0.0, 1.0);
    value.schlick = pow5(1.0 - value.x);
    return value;
}

// Samples a visible normal of the lobe around +z (Dupuy and Benyoub 2023, Sampling Visible GGX Normals with Spherical
// Caps). Precondition: wo.z > 0.
vec3 sample_visible_normal(vec3 wo, vec2 alpha, vec2 xi) {
    vec3 stretched = normalize(vec3(alpha * wo.xy, wo.z));
    float z = (1.0 - xi.y) * (1.0 + stretched.z) - stretched.z;
    float sine = sqrt(max(0.0, (1.0 - z) * (1.0 + z)));
    float phi = 6.28318530718 * xi.x;
    vec3 h = vec3(sine * cos(phi), sine * sin(phi), z) + stretched;
    // h.z >= 0 up to rounding; the minimum keeps a normal if h has cancelled completely.
    return normalize(vec3(alpha * h.xy, max(h.z, 1e-20)));
}

vec2 albedo_texel(ivec2 at) { return texelFetch(albedo_table, at.y * kAlbedoTableSize + at.x).rg; }

// Returns an entry of the part of the albedo table that starts at a row. engine/tables/albedo.h describes the table.
// The code is precise, because the results of callers are: Mesa 22.3 makes all code behind such a result precise, and
// Mesa 25.0 only that of the same function.
vec2 albedo_entry(vec2 coordinates, int first_row) {
    precise vec2 at = coordinates * float(kAlbedoTableSize - 1);
    precise vec2 cell = clamp(floor(at), 0.0, float(kAlbedoTableSize - 2));
    precise vec2 f = at - cell;
    ivec2 c = ivec2(cell) + ivec2(0, first_row);
    precise vec2 low = mix(albedo_texel(c), albedo_texel(c + ivec2(1, 0)), f.x);
    ++c.y;
    precise vec2 high = mix(albedo_texel(c), albedo_texel(c + ivec2(1, 0)), f.x);
    precise vec2 entry = mix(low, high, f.y);
    return entry;
}

// Returns the directional albedo of the lobe (SHADING.md): x = E_A, y = E_B. Precise as albedo_entry().
vec2 ggx_albedo(float cosine, float alpha) {
    float mu = clamp(cosine, 0.0, 1.0);
    precise float mirror = pow5(1.0 - mu);
    if (alpha < kMirrorAlpha) return vec2(1.0 - mirror, mirror);
    vec2 entry = albedo_entry(albedo_coordinates(mu, alpha), 0);
    precise float edge = entry.x * clamp(mirror + entry.y, 0.0, 1.0);
    precise vec2 albedo = vec2(entry.x - edge, edge);
    return albedo;
}

// --- Anisotropic GGX -------------------------------------------------------------------------------------------------

// Returns length(alpha w.xy, w.z), which takes the place of ggx_root().
float ggx_root(vec3 local, vec2 alpha) { return length(vec3(alpha * local.xy, local.z)); }

// Evaluates a lobe as above. The columns of `basis` are the direction of alpha.x, that of alpha.y, and n.
GgxValue ggx_evaluate(mat3 basis, vec2 alpha, vec3 wo, vec3 wi) {
    vec3 sum = wo + wi;
    vec3 h = sum * inversesqrt(max(dot(sum, sum), 1e-30));
    vec3 local_h = h * basis;
    vec2 slopes = local_h.xy / alpha;
    float k = dot(slopes, slopes) + local_h.z * local_h.z;
    float density = 0.318309886184 / (alpha.x * alpha.y * k * k);
    vec3 local_o = wo * basis;
    local_o.z = max(local_o.z, 0.0);
    vec3 local_i = wi * basis;
    local_i.z = max(local_i.z, 1e-20);
    float root_o = ggx_root(local_o, alpha);
    float root_i = ggx_root(local_i, alpha);
    GgxValue value;
    value.scattered = 0.5 * density / (local_o.z * root_i / local_i.z + root_o);
    value.pdf = 0.5 * density / (local_o.z + root_o);
    value.x = clamp(dot(wo, h), 0.0, 1.0);
    value.schlick = pow5(1.0 - value.x);
    return value;
}

// Returns the directional albedo of the lobe: x = E_A, y = E_B. wo is in the lobe's basis.
vec2 ggx_albedo(vec3 wo, vec2 alpha) {
    vec4 last = vec4(kAnisotropyCosines, kAnisotropyAngles, kAnisotropyRoughnesses, kAnisotropyStrengths) - 1.0;
    vec4 at = anisotropy_coordinates(wo, alpha) * last;
    vec4 cell = clamp(floor(at), vec4(0.0), last - 1.0);
    vec4 f = at - cell;
    vec2 entry = vec2(0.0);
    for (int corner = 0; corner < 16; ++corner) {
        ivec4 step = (ivec4(corner) >> ivec4(0, 1, 2, 3)) & 1;
        vec4 weight = mix(1.0 - f, f, vec4(step));
        ivec2 texel = anisotropy_texel(ivec4(cell) + step) + ivec2(0, kAnisotropyRow);
        entry += weight.x * weight.y * weight.z * weight.w * albedo_texel(texel);
    }
    float edge = entry.x * clamp(pow5(1.0 - clamp(wo.z, 0.0, 1.0)) + entry.y, 0.0, 1.0);
    return vec2(entry.x - edge, edge);
}

// --- Thin film -------------------------------------------------------------------------------------------------------

// Terms of the reflectance of a film at one cosine that do not depend on what is below it (SHADING.md, Iridescence).
struct FilmWaves {
    float ior;          // index of refraction of the film
    float presence;     // 0: no film
    float edge;         // (1 - x)^5
    float reflected;    // R_12
    float grazing;      // (1 - cosine in the film)^5
    vec3 first, second; // twice the sensitivities S(1), S(2)
};

// Returns the sensitivity of linear Rec.709 to interference with a phase of 2 pi / 1 nm times the path difference.
vec3 film_sensitivity(float path) {
    float phase = min(6.28318530718e-9 * path, 1e-3);  // larger ones have the sensitivity 0, too
    float p = phase * phase;
    vec3 xyz = vec3(0.846602, 1.000211, 1.001088) * cos(phase * vec3(1.6810e6, 1.7953e6, 2.2084e6)) *
               exp(-p * vec3(4.3278e9, 9.3046e9, 6.6121e9));
    xyz.x += 0.153871 * cos(phase * 2.2399e6) * exp(-p * 4.5282e9);
    return vec3(dot(vec3(3.2404542, -1.5371385, -0.4985314), xyz), dot(vec3(-0.9692660, 1.8760108, 0.0415560), xyz),
                dot(vec3(0.0556434, -0.2040259, 1.0572252), xyz));
}

FilmWaves film_waves(float film_ior, float thickness, float cosine) {
    FilmWaves w;
    float x = clamp(cosine, 0.0, 1.0);
    w.ior = film_ior;
    w.presence = smoothstep(0.0, 0.03, thickness) * smoothstep(1.0, 1.05, film_ior);
    w.edge = pow5(1.0 - x);
    float r = (w.ior - 1.0) / (w.ior + 1.0);
    w.reflected = mix(w.edge, 1.0, r * r);
    float below = sqrt(max(1.0 - (1.0 - x * x) / (w.ior * w.ior), 0.0));
    w.grazing = pow5(1.0 - below);
    float path = 2.0 * w.ior * min(thickness, 1e9) * below;
    w.first = 2.0 * film_sensitivity(path);
    w.second = 2.0 * film_sensitivity(2.0 * path);
    return w;
}

// Returns the reflectance of the film on a substrate with this reflectance at normal incidence, in [0, 1].
vec3 film_reflectance(FilmWaves w, vec3 f0) {
    vec3 root = sqrt(clamp(f0, 0.0, 0.999999));
    vec3 ior = (1.0 + root) / (1.0 - root);
    vec3 r = (ior - w.ior) / (ior + w.ior);
    vec3 below = mix(vec3(w.grazing), vec3(1.0), r * r);  // R_23
    float through = 1.0 - w.reflected;
    vec3 product = min(w.reflected * below, 0.9999);
    vec3 root_product = sqrt(product);
    vec3 series = through * through * below / (1.0 - product);
    vec3 amplitude = (series - through) * root_product;
    vec3 phase_sign = mix(vec3(-1.0), vec3(1.0), lessThan(ior, vec3(w.ior)));
    vec3 sum = w.reflected + series + amplitude * phase_sign * w.first + amplitude * root_product * w.second;
    return mix(mix(f0, vec3(1.0), w.edge), clamp(sum, 0.0, 1.0), w.presence);
}

// --- Solid transmission ----------------------------------------------------------------------------------------------

// Returns the Fresnel reflectance of a dielectric for unpolarised light, 1 in total internal reflection. x: cosine of
// wo with the microfacet's normal; eta: index of refraction beyond the surface over that on wo's side.
float fresnel_dielectric(float x, float eta) {
    float square = ((eta - 1.0) * (eta + 1.0) + x * x) / (eta * eta);  // squared cosine of the refracted direction
    float refracted = sqrt(max(square, 0.0));
    float across = (x - eta * refracted) / max(x + eta * refracted, 1e-20);
    float along = (eta * x - refracted) / max(eta * x + refracted, 1e-20);
    return square <= 0.0 ? 1.0 : 0.5 * (across * across + along * along);
}

// Returns the direction of light that reaches wo through a microfacet of normal h, which is on wo's side (Walter et al.
// 2007, eq. 40). Precondition: no total internal reflection.
vec3 refracted_direction(vec3 wo, vec3 h, float eta) {
    float x = dot(wo, h);
    float refracted = sqrt(max((eta - 1.0) * (eta + 1.0) + x * x, 0.0));
    return normalize((x - refracted) * h - wo);
}

// Value of refraction in one direction.
struct RefractedValue {
    float scattered;  // f mu_i of basic radiance, without the Fresnel transmittance (Walter et al. 2007, eq. 21)
    float pdf;        // density of visible-normal sampling, per solid angle (eq. 17)
    float x;          // dot(wo, h), h on wo's side; 0: there is no such microfacet
};

// Evaluates refraction. wo and wi: unit length, on different sides of n.
RefractedValue refracted_evaluate(vec3 n, float alpha, float eta, vec3 wo, vec3 wi) {
    vec3 sum = wo + eta * wi;
    float square = max(dot(sum, sum), 1e-30);
    vec3 h = sum * inversesqrt(square);
    h = dot(h, n) < 0.0 ? -h : h;
    float x = dot(wo, h);
    float y = -dot(wi, h);
    vec3 across = cross(h, n);
    float density = ggx_density(dot(h, n), dot(across, across), alpha);
    float mu_o = max(dot(n, wo), 0.0);
    float mu_i = -dot(n, wi);
    float root_o = ggx_root(mu_o, alpha);
    // The denominator of eq. 17 is the squared length of the sum.
    float jacobian = 2.0 * density * x * y * eta * eta / square;
    bool faces = x > 0.0 && y > 0.0;
    RefractedValue value;
    value.scattered = faces ? jacobian / (mu_o * ggx_root(mu_i, alpha) / mu_i + root_o) : 0.0;
    value.pdf = faces ? jacobian / (mu_o + root_o) : 0.0;
    value.x = faces ? x : 0.0;
    return value;
}

// Returns the directional albedo of reflection and refraction of a white interface. strength: factor of the Fresnel
// reflectance.
float solid_albedo(float cosine, float alpha, float eta, float strength) {
    vec3 size = vec3(kSolidTableSize, kSolidTableSize, kSolidTableSlices);
    vec3 at = solid_coordinates(clamp(cosine, 0.0, 1.0), alpha, eta) * (size - 1.0);
    vec3 cell = clamp(floor(at), vec3(0.0), size - 2.0);
    vec3 f = at - cell;
    vec2 found = vec2(0.0);
    for (int i = 0; i < 8; ++i) {
        ivec3 step = ivec3(i & 1, (i >> 1) & 1, i >> 2);
        ivec3 node = ivec3(cell) + step;
        vec3 weight = mix(1.0 - f, f, vec3(step));
        ivec2 texel = node.xy + kSolidTableSize * ivec2(node.z % kSolidTableColumns, node.z / kSolidTableColumns);
        texel.y += kSolidTableRow;
        found += weight.x * weight.y * weight.z * albedo_texel(texel);
    }
    // Beyond the last slice, the albedo approaches that of a white mirroring lobe as the reflectance F_0 approaches 1.
    float r = (eta - 1.0) / (eta + 1.0);
    const float last = kSolidReflectance * kSolidReflectance;
    float beyond = eta > 1.0 ? clamp((r * r - last) / (1.0 - last), 0.0, 1.0) : 0.0;
    vec2 mirror = ggx_albedo(cosine, alpha);
    found.x += beyond * (mirror.x + mirror.y - found.x);
    return strength < 1.0 ? mix(found.y, found.x, strength) : found.x;
}

// --- Sheen -----------------------------------------------------------------------------------------------------------

// Returns l_h of the sheen (SHADING.md), times mu_i.
float sheen_scattered(vec3 n, float alpha, vec3 wo, vec3 wi) {
    vec3 sum = wo + wi;
    vec3 across = cross(sum * inversesqrt(max(dot(sum, sum), 1e-30)), n);
    float density = (2.0 + 1.0 / alpha) * pow(dot(across, across), 0.5 / alpha) * 0.159154943092;
    float mu_i = dot(n, wi);
    float q_o = length(vec2(dot(n, wo), kSheenHorizon));
    float q_i = length(vec2(mu_i, kSheenHorizon));
    return density * mu_i / (4.0 * q_o * q_i * (1.0 + sheen_lambda(q_o, alpha) + sheen_lambda(q_i, alpha)));
}

// Samples a direction around +z whose cosine has the density exp(-cosine / w) / (w (1 - exp(-1 / w))), w = 2
// sqrt(alpha).
vec3 sample_sheen(float alpha, vec2 xi) {
    float w = 2.0 * sqrt(alpha);
    float z = clamp(-w * log(1.0 - xi.y * (1.0 - exp(-1.0 / w))), 0.0, 1.0);
    float phi = 6.28318530718 * xi.x;
    return vec3(sqrt((1.0 - z) * (1.0 + z)) * vec2(cos(phi), sin(phi)), z);
}

// Returns the density of sample_sheen() per solid angle.
float sheen_pdf(float cosine, float alpha) {
    float w = 2.0 * sqrt(alpha);
    return 0.159154943092 * exp(-cosine / w) / (w * (1.0 - exp(-1.0 / w)));
}

// Returns the directional albedo of the lobe, which exceeds 1 at grazing angles.
float sheen_albedo(float cosine, float roughness) {
    return albedo_entry(sheen_coordinates(clamp(cosine, 0.0, 1.0), roughness), kAlbedoTableSize).x;
}
