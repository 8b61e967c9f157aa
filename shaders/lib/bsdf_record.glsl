// The BSDF at one vertex for one outgoing direction, and its rows in surface records and for path reuse.
#include "shaders/lib/lobes.glsl"
#include "shaders/shared/surface_rows.h"

// The material for one wo. All factors that depend on wo alone are included: Fresnel, multiple scattering, coat.
struct Bsdf {
    vec3 geometric_normal;  // n_g, or the smooth surface's normal in its place (SHADING.md, Shading normals)
    float p_diffuse;        // probability P_d of the diffuse component; the glossy component has 1 - P_d
    vec3 normal;            // n; specular and transmission have base_normal()
    float alpha;            // roughness of specular and transmission; 0: mirror
    vec3 diffuse;           // albedo of the diffuse lobe
    float p_transmission;   // probability of transmission among the glossy lobes
    vec3 specular;          // the lobe is D G2 / (4 mu_o mu_i) (specular + specular_edge (1 - x)^5)
    float p_coat;           // probability of the coat among the glossy lobes
    vec3 specular_edge;
    float coat_alpha;       // roughness of the coat; 0: mirror
    vec3 transmission;      // factor of the mirrored D G2 / (4 mu_o mu_i)
    float coat;             // factor of D G2 / (4 mu mu_i) F(0.04, 1, x)
    vec3 coat_normal;       // n_k, bent so that it reflects above the horizon
    vec3 sheen;             // factor of sheen_scattered()
    float sheen_alpha;      // roughness of the sheen
    float p_sheen;          // probability of the sheen among the glossy lobes
    vec3 rough_direction;   // unit length, perpendicular to n: the direction in which `alpha` applies
    float alpha_across;     // roughness across it and of solid interfaces; `alpha`: the lobe is isotropic
    vec3 film_dielectric;   // factors of D G2 / (4 mu_o mu_i) film_reflectance() of both substrates
    float film_ior;
    vec3 film_metal;
    float film_thickness;   // nanometres
    vec3 film_dielectric_f0;
    vec3 film_metal_f0;
    vec3 solid_reflection;  // solids: factor of the light that the interface reflects; `transmission` is that of the rest
    float solid_specular;   // solids: factor of the Fresnel reflectance, in [0, 1]
    float eta;              // solids: index of refraction beyond the surface over that on wo's side; 0: thin-walled
    vec3 absorption;        // solids: absorption per world unit inside
    float thickness;        // solids: length of a path inside that never ends; < 0: wo is inside
    float solid_gain;       // solids: gain of rough reflection and transmission
    vec3 coat_tint;         // factor of the coat's light
    bool disperses;         // true: the lobes are those of one colour channel, and so are paths from here on
    vec3 diffuse_through;   // albedo of diffuse transmission
    float p_through;        // probability of diffuse transmission within the diffuse component
};

// The macros HALFLIGHT_*_ROW are the first rows of lobes (engine/tables/needs.cpp).
const uint kBsdfRows = HALFLIGHT_SURFACE_ROWS - uint(kBsdfRow) - (HALFLIGHT_LIGHT_LINKS != 0 ? 1u : 0u);

void make_thin(inout Bsdf b) {
    b.solid_reflection = vec3(0.0);
    b.solid_specular = 1.0;
    b.eta = 0.0;
    b.absorption = vec3(0.0);
    b.thickness = 0.0;
    b.solid_gain = 0.0;
    b.coat_tint = vec3(1.0);
    b.disperses = false;
}

// Scales the lobes of the base without transmission through it.
void scale_base(precise inout Bsdf b, vec3 factor) {
    b.diffuse *= factor;
    b.diffuse_through *= factor;
    b.specular *= factor;
    b.specular_edge *= factor;
    b.film_dielectric *= factor;
    b.film_metal *= factor;
}

void scale_lobes(inout Bsdf b, vec3 factor) {
    scale_base(b, factor);
    b.transmission *= factor;
    b.solid_reflection *= factor;
    b.sheen *= factor;
    b.coat_tint *= factor;
}

// Makes the surface of a shadow catcher, which reflects all light diffusely. No path leaves it: light samples have the
// whole weight.
void make_catcher(inout Bsdf b) {
    scale_base(b, vec3(0.0));
    b.diffuse = vec3(1.0);
    b.p_diffuse = 0.0;
    b.transmission = vec3(0.0);
    b.solid_reflection = vec3(0.0);
    b.coat = 0.0;
    b.sheen = vec3(0.0);
}

vec4[kBsdfRows] pack_bsdf(Bsdf b) {
    vec4 rows[kBsdfRows];
    rows[0] = vec4(b.geometric_normal, b.p_diffuse);
    rows[1] = vec4(b.normal, b.alpha);
    rows[2] = vec4(b.diffuse, b.p_transmission);
    if (kGlossy) {
        rows[HALFLIGHT_GLOSSY_ROW] = vec4(b.specular, b.p_coat);
        rows[HALFLIGHT_GLOSSY_ROW + 1] = vec4(b.specular_edge, b.coat_alpha);
    }
    if (kTransmission) rows[HALFLIGHT_TRANSMISSION_ROW] = vec4(b.transmission, b.solid_specular);
    if (kClearcoat) rows[HALFLIGHT_CLEARCOAT_ROW] = vec4(b.coat_normal, b.coat);
    if (kSheen) {
        rows[HALFLIGHT_SHEEN_ROW] = vec4(b.sheen, b.sheen_alpha);
        rows[HALFLIGHT_SHEEN_ROW + 1] = vec4(b.p_sheen, 0.0, 0.0, 0.0);
    }
    if (kAnisotropy) rows[HALFLIGHT_ANISOTROPY_ROW] = vec4(b.rough_direction, b.alpha_across);
    if (kIridescence) {
        int row = HALFLIGHT_IRIDESCENCE_ROW;  // no constant, because scenes without films have fewer rows
        rows[row] = vec4(b.film_dielectric, b.film_ior);
        rows[row + 1] = vec4(b.film_metal, b.film_thickness);
        rows[row + 2] = vec4(b.film_dielectric_f0, 0.0);
        rows[row + 3] = vec4(b.film_metal_f0, 0.0);
    }
    if (kVolume) {
        rows[HALFLIGHT_VOLUME_ROW] = vec4(b.solid_reflection, b.eta);
        rows[HALFLIGHT_VOLUME_ROW + 1] = vec4(b.absorption, b.thickness);
        rows[HALFLIGHT_VOLUME_ROW + 2] = vec4(b.coat_tint, b.disperses ? -b.solid_gain : b.solid_gain);
    }
    if (kDiffuseTransmission) rows[HALFLIGHT_DIFFUSE_TRANSMISSION_ROW] = vec4(b.diffuse_through, b.p_through);
    return rows;
}

Bsdf unpack_bsdf(vec4 rows[kBsdfRows]) {
    Bsdf b;
    b.geometric_normal = rows[0].xyz;
    b.p_diffuse = rows[0].w;
    b.normal = rows[1].xyz;
    b.alpha = rows[1].w;
    b.diffuse = rows[2].rgb;
    b.p_transmission = rows[2].w;
    b.specular = vec3(0.0);
    b.p_coat = 0.0;
    b.specular_edge = vec3(0.0);
    b.coat_alpha = 0.0;
    b.transmission = vec3(0.0);
    b.coat_normal = b.normal;
    b.coat = 0.0;
    b.sheen = vec3(0.0);
    b.sheen_alpha = 1.0;
    b.p_sheen = 0.0;
    b.rough_direction = vec3(0.0);
    b.alpha_across = b.alpha;
    b.film_dielectric = vec3(0.0);
    b.film_ior = 1.0;
    b.film_metal = vec3(0.0);
    b.film_thickness = 0.0;
    b.film_dielectric_f0 = vec3(0.0);
    b.film_metal_f0 = vec3(0.0);
    make_thin(b);
    b.diffuse_through = vec3(0.0);
    b.p_through = 0.0;
    if (kGlossy) {
        b.specular = rows[HALFLIGHT_GLOSSY_ROW].rgb;
        b.p_coat = rows[HALFLIGHT_GLOSSY_ROW].w;
        b.specular_edge = rows[HALFLIGHT_GLOSSY_ROW + 1].rgb;
        b.coat_alpha = rows[HALFLIGHT_GLOSSY_ROW + 1].w;
    }
    if (kTransmission) {
        b.transmission = rows[HALFLIGHT_TRANSMISSION_ROW].rgb;
        b.solid_specular = rows[HALFLIGHT_TRANSMISSION_ROW].w;
    }
    if (kClearcoat) {
        b.coat_normal = rows[HALFLIGHT_CLEARCOAT_ROW].xyz;
        b.coat = rows[HALFLIGHT_CLEARCOAT_ROW].w;
    }
    if (kSheen) {
        b.sheen = rows[HALFLIGHT_SHEEN_ROW].rgb;
        b.sheen_alpha = rows[HALFLIGHT_SHEEN_ROW].w;
        b.p_sheen = rows[HALFLIGHT_SHEEN_ROW + 1].x;
    }
    if (kAnisotropy) {
        b.rough_direction = rows[HALFLIGHT_ANISOTROPY_ROW].xyz;
        b.alpha_across = rows[HALFLIGHT_ANISOTROPY_ROW].w;
    }
    if (kIridescence) {
        int row = HALFLIGHT_IRIDESCENCE_ROW;  // no constant, because scenes without films have fewer rows
        b.film_dielectric = rows[row].rgb;
        b.film_ior = rows[row].w;
        b.film_metal = rows[row + 1].rgb;
        b.film_thickness = rows[row + 1].w;
        b.film_dielectric_f0 = rows[row + 2].rgb;
        b.film_metal_f0 = rows[row + 3].rgb;
    }
    if (kVolume) {
        b.solid_reflection = rows[HALFLIGHT_VOLUME_ROW].rgb;
        b.eta = rows[HALFLIGHT_VOLUME_ROW].w;
        b.absorption = rows[HALFLIGHT_VOLUME_ROW + 1].rgb;
        b.thickness = rows[HALFLIGHT_VOLUME_ROW + 1].w;
        b.coat_tint = rows[HALFLIGHT_VOLUME_ROW + 2].rgb;
        b.solid_gain = abs(rows[HALFLIGHT_VOLUME_ROW + 2].w);
        b.disperses = rows[HALFLIGHT_VOLUME_ROW + 2].w < 0.0;
    }
    if (kDiffuseTransmission) {
        b.diffuse_through = rows[HALFLIGHT_DIFFUSE_TRANSMISSION_ROW].rgb;
        b.p_through = rows[HALFLIGHT_DIFFUSE_TRANSMISSION_ROW].w;
    }
    return b;
}
