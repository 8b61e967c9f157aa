// The layers above the base, the energy that they leave to it, and their rows for path reuse.
#include "shaders/lib/microfacet.glsl"
#include "shaders/lib/onb.glsl"
#include "shaders/shared/ordered_dot.h"

const float kCoatF0 = 0.04;

// Parameters of the layers through which diffuse light leaves a surface.
struct Layers {
    vec3 normal;  // n
    vec3 horizon;  // Bsdf::geometric_normal; 0 on solids, whose normals are not bent
    float alpha;  // roughness of the specular lobe
    float f0;     // largest component of the dielectric's f0
    float f90;    // f90 of the dielectric
    float coat;   // strength of the coat; 0: none
    float coat_alpha;
    vec3 coat_normal;
    float sheen;  // largest component of the sheen's colour
    float sheen_roughness;
    vec3 rough_direction;
    float alpha_across;
    vec3 film_f0;   // f0 of the dielectric below the film, without its strength f90
    float film;     // factor of the film; 0: none
    float film_ior;
    float film_thickness;
};

// The macros HALFLIGHT_*_LAYER are the first rows of lobes (engine/tables/needs.cpp).
vec4[HALFLIGHT_LAYER_ROWS] pack_layers(Layers l) {
    vec4 rows[HALFLIGHT_LAYER_ROWS];
    rows[0] = vec4(l.normal, l.alpha);
    rows[1] = vec4(l.horizon, 0.0);
    if (kGlossy) rows[HALFLIGHT_GLOSSY_LAYER] = vec4(l.f0, l.f90, l.coat, l.coat_alpha);
    if (kClearcoat) rows[HALFLIGHT_CLEARCOAT_LAYER] = vec4(l.coat_normal, 0.0);
    if (kSheen) rows[HALFLIGHT_SHEEN_LAYER] = vec4(l.sheen, l.sheen_roughness, 0.0, 0.0);
    if (kAnisotropy) rows[HALFLIGHT_ANISOTROPY_LAYER] = vec4(l.rough_direction, l.alpha_across);
    if (kIridescence) {
        rows[HALFLIGHT_IRIDESCENCE_LAYER] = vec4(l.film_f0, l.film);
        rows[HALFLIGHT_IRIDESCENCE_LAYER + 1] = vec4(l.film_ior, l.film_thickness, 0.0, 0.0);
    }
    return rows;
}

Layers unpack_layers(vec4 rows[HALFLIGHT_LAYER_ROWS]) {
    Layers l;
    l.normal = rows[0].xyz;
    l.alpha = rows[0].w;
    l.horizon = rows[1].xyz;
    if (kGlossy) {
        l.f0 = rows[HALFLIGHT_GLOSSY_LAYER].x;
        l.f90 = rows[HALFLIGHT_GLOSSY_LAYER].y;
        l.coat = rows[HALFLIGHT_GLOSSY_LAYER].z;
        l.coat_alpha = rows[HALFLIGHT_GLOSSY_LAYER].w;
    }
    if (kClearcoat) l.coat_normal = rows[HALFLIGHT_CLEARCOAT_LAYER].xyz;
    if (kSheen) {
        l.sheen = rows[HALFLIGHT_SHEEN_LAYER].x;
        l.sheen_roughness = rows[HALFLIGHT_SHEEN_LAYER].y;
    }
    if (kAnisotropy) {
        l.rough_direction = rows[HALFLIGHT_ANISOTROPY_LAYER].xyz;
        l.alpha_across = rows[HALFLIGHT_ANISOTROPY_LAYER].w;
    }
    if (kIridescence) {
        l.film_f0 = rows[HALFLIGHT_IRIDESCENCE_LAYER].rgb;
        l.film = rows[HALFLIGHT_IRIDESCENCE_LAYER].w;
        l.film_ior = rows[HALFLIGHT_IRIDESCENCE_LAYER + 1].x;
        l.film_thickness = rows[HALFLIGHT_IRIDESCENCE_LAYER + 1].y;
    }
    return l;
}

// Returns whether diffuse light leaves in direction wo, on the side of all normals (SHADING.md, Surfaces).
bool leaves_base(Layers l, vec3 wo) {
    bool leaves = dot(l.normal, wo) > 0.0 && dot(l.horizon, wo) >= 0.0;
    if (kClearcoat) leaves = leaves && (l.coat == 0.0 || dot(l.coat_normal, wo) > 0.0);
    return leaves;
}

// Returns the gain M of a lobe for the energy lost to multiple scattering (Turquin 2019, eq. 16). Precise, so that all
// versions of Mesa compute equal bits.
float multiple_scattering_gain(float f0, float albedo) {
    precise float gain = 1.0 + f0 * ((1.0 - albedo) / albedo);
    return gain;
}
vec3 multiple_scattering_gain(vec3 f0, float albedo) {
    precise vec3 gain = 1.0 + f0 * ((1.0 - albedo) / albedo);
    return gain;
}

// Bends a normal n just enough for the mirror direction of wo to lie above the horizon (SHADING.md, Shading normals).
// Other normals are returned bit for bit, and so are all of them if the horizon is 0. Precondition: dot(n, wo) > 0 and
// dot(horizon, wo) >= 0.
vec3 reflecting_normal(vec3 n, vec3 horizon, vec3 wo) {
    vec3 mirrored = 2.0 * dot(n, wo) * n - wo;
    float height = dot(mirrored, horizon);
    float least = min(0.9 * dot(horizon, wo), 0.01);
    vec3 along = mirrored - height * horizon;
    vec3 valid = along * (sqrt(1.0 - least * least) * inversesqrt(max(dot(along, along), 1e-12))) + least * horizon;
    vec3 half_way = wo + valid;
    float square = dot(half_way, half_way);
    // The half vector vanishes for views along the horizon whose mirror direction points away from the viewer. Below a
    // length of 0.01, cancellation has cost it most of its bits.
    vec3 bent = square > 1e-4 ? half_way * inversesqrt(square) : horizon;
    return height < least ? bent : n;
}

// Returns the basis of a lobe around n: `along` has unit length and is perpendicular to n.
mat3 lobe_basis(vec3 n, vec3 along) { return mat3(along, cross(n, along), n); }

// Returns the basis of the base's lobe. bent: what reflecting_normal() made of n.
mat3 bent_basis(vec3 n, vec3 along, vec3 bent) {
    vec3 turned = along - dot(along, bent) * bent;
    float square = dot(turned, turned);
    turned = square > 1e-8 ? turned * inversesqrt(square) : basis_around(bent)[0];
    return lobe_basis(bent, bent == n ? along : turned);
}

// Returns the directional albedo of the specular lobe: x = E_A, y = E_B.
vec2 specular_albedo(Layers l, vec3 wo) {
    vec3 n = reflecting_normal(l.normal, l.horizon, wo);
    vec2 albedo = ggx_albedo(ordered_dot(n, wo), l.alpha);
    if (kAnisotropy && l.alpha != l.alpha_across)
        albedo = ggx_albedo(wo * bent_basis(l.normal, l.rough_direction, n), vec2(l.alpha, l.alpha_across));
    return albedo;
}

// Returns the film at the cosine whose Schlick weight is the mean of the lobe, E_B / E_1.
FilmWaves mean_film_waves(Layers l, vec2 albedo) {
    return film_waves(l.film_ior, l.film_thickness, 1.0 - pow(albedo.y / (albedo.x + albedo.y), 0.2));
}

// Returns the share 1 - E_d of light that the dielectric's specular lobe of a directional albedo leaves to the base.
float specular_share(Layers l, vec2 albedo) {
    float gain = multiple_scattering_gain(l.f0, albedo.x + albedo.y);
    if (kIridescence && l.film > 0.0) {
        float whole = albedo.x + albedo.y;
        vec3 mean = film_reflectance(mean_film_waves(l, albedo), l.film_f0);
        vec3 plain_f0 = l.film_f0 * l.f90;
        vec3 plain = multiple_scattering_gain(plain_f0, whole) * (plain_f0 * albedo.x + l.f90 * albedo.y);
        vec3 film = l.f90 * multiple_scattering_gain(mean, whole) * mean * whole;
        vec3 both = mix(plain, film, l.film);
        return 1.0 - min(max(both.r, max(both.g, both.b)), 1.0);
    }
    precise float share = 1.0 - min(gain * (l.f0 * albedo.x + l.f90 * albedo.y), 1.0);
    return share;
}

// Returns the factor k M(0.04) of the coat's lobe, and the coat's albedo k E_k.
vec2 coat_reflection(Layers l, vec3 wo) {
    vec2 albedo = ggx_albedo(dot(reflecting_normal(l.coat_normal, l.horizon, wo), wo), l.coat_alpha);
    precise float factor = l.coat * multiple_scattering_gain(kCoatF0, albedo.x + albedo.y);
    precise float reflected = factor * (kCoatF0 * albedo.x + albedo.y);
    return vec2(factor, reflected);
}

// Returns the share 1 - s E_s of light that the sheen of albedo E_s leaves to the layers below it.
float sheen_share(Layers l, float albedo) {
    precise float share = 1.0 - l.sheen * min(albedo, 1.0);
    return share;
}

// Returns the share of light that the layers leave to the base. The base's albedo for wo is this share times a
// constant.
float base_share(Layers l, vec3 wo) {
    precise float share = 1.0;
    if (kGlossy) share = specular_share(l, specular_albedo(l, wo));
    if (kSheen) share *= sheen_share(l, sheen_albedo(dot(l.normal, wo), l.sheen_roughness));
    if (kClearcoat) share *= 1.0 - coat_reflection(l, wo).y;
    return share;
}
