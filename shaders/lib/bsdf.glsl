// The BSDF of shaders/SHADING.md at one vertex, for one outgoing direction. It is packed for surface records and for path
// reuse, and made from a material if shaders/lib/material.glsl is included before.
#include "shaders/lib/microfacet.glsl"
#include "shaders/lib/onb.glsl"
#include "shaders/lib/sampling.glsl"

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

const float kCoatF0 = 0.04;

// --- Rows of surface records ------------------------------------------------------------------------------------------

const uint kBsdfRows = HALFLIGHT_SURFACE_ROWS - 2u;  // rows without those of SurfacePoint
const int kGlossyRow = 3;
const int kTransmissionRow = 5;
#ifdef HALFLIGHT_TRANSMISSION
const int kCoatRow = kTransmissionRow + 1;
#else
const int kCoatRow = kTransmissionRow;
#endif
#ifdef HALFLIGHT_CLEARCOAT
const int kSheenRow = kCoatRow + 1;
#else
const int kSheenRow = kCoatRow;
#endif
#ifdef HALFLIGHT_SHEEN
const int kAnisotropyRecordRow = kSheenRow + 2;
#else
const int kAnisotropyRecordRow = kSheenRow;
#endif
#ifdef HALFLIGHT_ANISOTROPY
const int kFilmRow = kAnisotropyRecordRow + 1;
#else
const int kFilmRow = kAnisotropyRecordRow;
#endif
#ifdef HALFLIGHT_IRIDESCENCE
const int kSolidRow = kFilmRow + 4;
#else
const int kSolidRow = kFilmRow;
#endif
#ifdef HALFLIGHT_VOLUME
const int kThroughRow = kSolidRow + 3;
#elif defined(HALFLIGHT_GLOSSY)
const int kThroughRow = kSolidRow;
#else
const int kThroughRow = kGlossyRow;
#endif

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

vec4[kBsdfRows] pack_bsdf(Bsdf b) {
    vec4 rows[kBsdfRows];
    rows[0] = vec4(b.geometric_normal, b.p_diffuse);
    rows[1] = vec4(b.normal, b.alpha);
    rows[2] = vec4(b.diffuse, b.p_transmission);
#ifdef HALFLIGHT_GLOSSY
    rows[kGlossyRow] = vec4(b.specular, b.p_coat);
    rows[kGlossyRow + 1] = vec4(b.specular_edge, b.coat_alpha);
#endif
#ifdef HALFLIGHT_TRANSMISSION
    rows[kTransmissionRow] = vec4(b.transmission, b.solid_specular);
#endif
#ifdef HALFLIGHT_CLEARCOAT
    rows[kCoatRow] = vec4(b.coat_normal, b.coat);
#endif
#ifdef HALFLIGHT_SHEEN
    rows[kSheenRow] = vec4(b.sheen, b.sheen_alpha);
    rows[kSheenRow + 1] = vec4(b.p_sheen, 0.0, 0.0, 0.0);
#endif
#ifdef HALFLIGHT_ANISOTROPY
    rows[kAnisotropyRecordRow] = vec4(b.rough_direction, b.alpha_across);
#endif
#ifdef HALFLIGHT_IRIDESCENCE
    rows[kFilmRow] = vec4(b.film_dielectric, b.film_ior);
    rows[kFilmRow + 1] = vec4(b.film_metal, b.film_thickness);
    rows[kFilmRow + 2] = vec4(b.film_dielectric_f0, 0.0);
    rows[kFilmRow + 3] = vec4(b.film_metal_f0, 0.0);
#endif
#ifdef HALFLIGHT_VOLUME
    rows[kSolidRow] = vec4(b.solid_reflection, b.eta);
    rows[kSolidRow + 1] = vec4(b.absorption, b.thickness);
    rows[kSolidRow + 2] = vec4(b.coat_tint, b.disperses ? -b.solid_gain : b.solid_gain);
#endif
#ifdef HALFLIGHT_DIFFUSE_TRANSMISSION
    rows[kThroughRow] = vec4(b.diffuse_through, b.p_through);
#endif
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
#ifdef HALFLIGHT_GLOSSY
    b.specular = rows[kGlossyRow].rgb;
    b.p_coat = rows[kGlossyRow].w;
    b.specular_edge = rows[kGlossyRow + 1].rgb;
    b.coat_alpha = rows[kGlossyRow + 1].w;
#endif
#ifdef HALFLIGHT_TRANSMISSION
    b.transmission = rows[kTransmissionRow].rgb;
    b.solid_specular = rows[kTransmissionRow].w;
#endif
#ifdef HALFLIGHT_CLEARCOAT
    b.coat_normal = rows[kCoatRow].xyz;
    b.coat = rows[kCoatRow].w;
#endif
#ifdef HALFLIGHT_SHEEN
    b.sheen = rows[kSheenRow].rgb;
    b.sheen_alpha = rows[kSheenRow].w;
    b.p_sheen = rows[kSheenRow + 1].x;
#endif
#ifdef HALFLIGHT_ANISOTROPY
    b.rough_direction = rows[kAnisotropyRecordRow].xyz;
    b.alpha_across = rows[kAnisotropyRecordRow].w;
#endif
#ifdef HALFLIGHT_IRIDESCENCE
    b.film_dielectric = rows[kFilmRow].rgb;
    b.film_ior = rows[kFilmRow].w;
    b.film_metal = rows[kFilmRow + 1].rgb;
    b.film_thickness = rows[kFilmRow + 1].w;
    b.film_dielectric_f0 = rows[kFilmRow + 2].rgb;
    b.film_metal_f0 = rows[kFilmRow + 3].rgb;
#endif
#ifdef HALFLIGHT_VOLUME
    b.solid_reflection = rows[kSolidRow].rgb;
    b.eta = rows[kSolidRow].w;
    b.absorption = rows[kSolidRow + 1].rgb;
    b.thickness = rows[kSolidRow + 1].w;
    b.coat_tint = rows[kSolidRow + 2].rgb;
    b.solid_gain = abs(rows[kSolidRow + 2].w);
    b.disperses = rows[kSolidRow + 2].w < 0.0;
#endif
#ifdef HALFLIGHT_DIFFUSE_TRANSMISSION
    b.diffuse_through = rows[kThroughRow].rgb;
    b.p_through = rows[kThroughRow].w;
#endif
    return b;
}

// --- The inside of solids ---------------------------------------------------------------------------------------------

#ifdef HALFLIGHT_VOLUME
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

// Returns the transmittance of a distance (Beer-Lambert). It is 0 where a float has no bits for it.
vec3 transmittance(vec4 medium, float distance) {
    return endless_way(medium) > 0.0 ? exp(-min(medium.rgb * distance, vec3(100.0))) : vec3(1.0);
}

// Returns whether reflection and refraction are perfect. Directions of nearly equal indices spread as little as those
// of nearly no roughness.
bool is_solid_mirror(Bsdf b) { return b.alpha_across * abs(b.eta - 1.0) < kMirrorAlpha; }

// Returns the share of light that a microfacet reflects at x = dot(wo, h). It refracts the rest.
float solid_fresnel(Bsdf b, float x) { return b.solid_specular * fresnel_dielectric(x, b.eta); }

void scale_lobes(inout Bsdf b, vec3 factor) {
    b.diffuse *= factor;
    b.diffuse_through *= factor;
    b.specular *= factor;
    b.specular_edge *= factor;
    b.film_dielectric *= factor;
    b.film_metal *= factor;
    b.transmission *= factor;
    b.solid_reflection *= factor;
    b.sheen *= factor;
    b.coat_tint *= factor;
}
#endif

// --- Layers above the base ------------------------------------------------------------------------------------------

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

const int kCoatLayerRow = 3;
#ifdef HALFLIGHT_CLEARCOAT
const int kSheenLayerRow = kCoatLayerRow + 1;
#else
const int kSheenLayerRow = kCoatLayerRow;
#endif
#ifdef HALFLIGHT_SHEEN
const int kAnisotropyLayerRow = kSheenLayerRow + 1;
#else
const int kAnisotropyLayerRow = kSheenLayerRow;
#endif
#ifdef HALFLIGHT_ANISOTROPY
const int kFilmLayerRow = kAnisotropyLayerRow + 1;
#else
const int kFilmLayerRow = kAnisotropyLayerRow;
#endif

vec4[HALFLIGHT_LAYER_ROWS] pack_layers(Layers l) {
    vec4 rows[HALFLIGHT_LAYER_ROWS];
    rows[0] = vec4(l.normal, l.alpha);
#ifdef HALFLIGHT_GLOSSY
    rows[1] = vec4(l.f0, l.f90, l.coat, l.coat_alpha);
    rows[2] = vec4(l.horizon, 0.0);
#endif
#ifdef HALFLIGHT_CLEARCOAT
    rows[kCoatLayerRow] = vec4(l.coat_normal, 0.0);
#endif
#ifdef HALFLIGHT_SHEEN
    rows[kSheenLayerRow] = vec4(l.sheen, l.sheen_roughness, 0.0, 0.0);
#endif
#ifdef HALFLIGHT_ANISOTROPY
    rows[kAnisotropyLayerRow] = vec4(l.rough_direction, l.alpha_across);
#endif
#ifdef HALFLIGHT_IRIDESCENCE
    rows[kFilmLayerRow] = vec4(l.film_f0, l.film);
    rows[kFilmLayerRow + 1] = vec4(l.film_ior, l.film_thickness, 0.0, 0.0);
#endif
    return rows;
}

Layers unpack_layers(vec4 rows[HALFLIGHT_LAYER_ROWS]) {
    Layers l;
    l.normal = rows[0].xyz;
    l.alpha = rows[0].w;
#ifdef HALFLIGHT_GLOSSY
    l.f0 = rows[1].x;
    l.f90 = rows[1].y;
    l.coat = rows[1].z;
    l.coat_alpha = rows[1].w;
    l.horizon = rows[2].xyz;
#endif
#ifdef HALFLIGHT_CLEARCOAT
    l.coat_normal = rows[kCoatLayerRow].xyz;
#endif
#ifdef HALFLIGHT_SHEEN
    l.sheen = rows[kSheenLayerRow].x;
    l.sheen_roughness = rows[kSheenLayerRow].y;
#endif
#ifdef HALFLIGHT_ANISOTROPY
    l.rough_direction = rows[kAnisotropyLayerRow].xyz;
    l.alpha_across = rows[kAnisotropyLayerRow].w;
#endif
#ifdef HALFLIGHT_IRIDESCENCE
    l.film_f0 = rows[kFilmLayerRow].rgb;
    l.film = rows[kFilmLayerRow].w;
    l.film_ior = rows[kFilmLayerRow + 1].x;
    l.film_thickness = rows[kFilmLayerRow + 1].y;
#endif
    return l;
}

// Returns whether diffuse light leaves in direction wo, on the side of all normals (SHADING.md, Surfaces).
bool leaves_base(Layers l, vec3 wo) {
    bool leaves = dot(l.normal, wo) > 0.0;
#ifdef HALFLIGHT_GLOSSY
    leaves = leaves && dot(l.horizon, wo) >= 0.0;
#endif
#ifdef HALFLIGHT_CLEARCOAT
    leaves = leaves && (l.coat == 0.0 || dot(l.coat_normal, wo) > 0.0);
#endif
    return leaves;
}

#ifdef HALFLIGHT_GLOSSY
// Returns the gain M of a lobe for the energy lost to multiple scattering (Turquin 2019, eq. 16).
float multiple_scattering_gain(float f0, float albedo) { return 1.0 + f0 * ((1.0 - albedo) / albedo); }
vec3 multiple_scattering_gain(vec3 f0, float albedo) { return 1.0 + f0 * ((1.0 - albedo) / albedo); }

// Bends a normal n just enough for the mirror direction of wo to lie above the horizon (SHADING.md, Shading normals).
// Other normals are returned bit for bit, and so are all of them where the horizon is 0. Precondition: dot(n, wo) > 0 and
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

#ifdef HALFLIGHT_ANISOTROPY
// Returns the basis of a lobe around n: `along` has unit length and is perpendicular to n.
mat3 lobe_basis(vec3 n, vec3 along) { return mat3(along, cross(n, along), n); }

// Returns the basis of the base's lobe. bent: what reflecting_normal() made of n.
mat3 bent_basis(vec3 n, vec3 along, vec3 bent) {
    vec3 turned = along - dot(along, bent) * bent;
    float square = dot(turned, turned);
    turned = square > 1e-8 ? turned * inversesqrt(square) : basis_around(bent)[0];
    return lobe_basis(bent, bent == n ? along : turned);
}
#endif

// Returns the directional albedo of the specular lobe: x = E_A, y = E_B.
vec2 specular_albedo(Layers l, vec3 wo) {
    vec3 n = reflecting_normal(l.normal, l.horizon, wo);
    vec2 albedo = ggx_albedo(dot(n, wo), l.alpha);
#ifdef HALFLIGHT_ANISOTROPY
    if (l.alpha != l.alpha_across)
        albedo = ggx_albedo(wo * bent_basis(l.normal, l.rough_direction, n), vec2(l.alpha, l.alpha_across));
#endif
    return albedo;
}

#ifdef HALFLIGHT_IRIDESCENCE
// Returns the film at the cosine whose Schlick weight is the mean of the lobe, E_B / E_1.
FilmWaves mean_film_waves(Layers l, vec2 albedo) {
    return film_waves(l.film_ior, l.film_thickness, 1.0 - pow(albedo.y / (albedo.x + albedo.y), 0.2));
}
#endif

// Returns the share 1 - E_d of light that the dielectric's specular lobe of a directional albedo leaves to the base.
float specular_share(Layers l, vec2 albedo) {
    float gain = multiple_scattering_gain(l.f0, albedo.x + albedo.y);
#ifdef HALFLIGHT_IRIDESCENCE
    if (l.film > 0.0) {
        float whole = albedo.x + albedo.y;
        vec3 mean = film_reflectance(mean_film_waves(l, albedo), l.film_f0);
        vec3 plain_f0 = l.film_f0 * l.f90;
        vec3 plain = multiple_scattering_gain(plain_f0, whole) * (plain_f0 * albedo.x + l.f90 * albedo.y);
        vec3 film = l.f90 * multiple_scattering_gain(mean, whole) * mean * whole;
        vec3 both = mix(plain, film, l.film);
        return 1.0 - min(max(both.r, max(both.g, both.b)), 1.0);
    }
#endif
    precise float share = 1.0 - min(gain * (l.f0 * albedo.x + l.f90 * albedo.y), 1.0);
    return share;
}
#endif

#ifdef HALFLIGHT_CLEARCOAT
// Returns the factor k M(0.04) of the coat's lobe, and the coat's albedo k E_k.
vec2 coat_reflection(Layers l, vec3 wo) {
    vec2 albedo = ggx_albedo(dot(reflecting_normal(l.coat_normal, l.horizon, wo), wo), l.coat_alpha);
    precise float factor = l.coat * multiple_scattering_gain(kCoatF0, albedo.x + albedo.y);
    precise float reflected = factor * (kCoatF0 * albedo.x + albedo.y);
    return vec2(factor, reflected);
}
#endif

#ifdef HALFLIGHT_SHEEN
// Returns the share 1 - s E_s of light that the sheen of albedo E_s leaves to the layers below it.
float sheen_share(Layers l, float albedo) {
    precise float share = 1.0 - l.sheen * min(albedo, 1.0);
    return share;
}
#endif

// Returns the share of light that the layers leave to the base. The base's albedo for wo is this share times a constant.
float base_share(Layers l, vec3 wo) {
    precise float share = 1.0;
#ifdef HALFLIGHT_GLOSSY
    share = specular_share(l, specular_albedo(l, wo));
#endif
#ifdef HALFLIGHT_SHEEN
    share *= sheen_share(l, sheen_albedo(dot(l.normal, wo), l.sheen_roughness));
#endif
#ifdef HALFLIGHT_CLEARCOAT
    share *= 1.0 - coat_reflection(l, wo).y;
#endif
    return share;
}

// --- From a material ------------------------------------------------------------------------------------------------

#ifdef HALFLIGHT_MATERIAL
float average(vec3 c) { return (c.r + c.g + c.b) * (1.0 / 3.0); }

float ggx_alpha(float roughness) {
    float alpha = roughness * roughness;
    return alpha < kMirrorAlpha ? 0.0 : alpha;
}

vec3 dielectric_f0(Material m) { return min(m.dielectric_f0 * m.specular_color, vec3(1.0)) * m.specular; }

bool is_solid(Material m) {
#ifdef HALFLIGHT_VOLUME
    return m.thickness > 0.0 && (m.transmission + m.diffuse_transmission) * (1.0 - m.metallic) > 0.0;
#else
    return false;
#endif
}

Layers layers_of(Material m, vec3 geometric_normal) {
    vec3 f0 = dielectric_f0(m);
    Layers l;
    l.normal = m.normal;
    l.horizon = is_solid(m) ? vec3(0.0) : geometric_normal;
    l.alpha = 0.0;
    l.f0 = max(f0.r, max(f0.g, f0.b));
    l.f90 = m.specular;
    l.coat = m.coat;
    l.coat_alpha = 0.0;
    l.coat_normal = m.coat_normal;
    l.sheen = max(m.sheen_color.r, max(m.sheen_color.g, m.sheen_color.b));
    l.sheen_roughness = max(m.sheen_roughness, kLeastSheenRoughness);
#ifdef HALFLIGHT_GLOSSY
    l.alpha = ggx_alpha(m.roughness);
#endif
#ifdef HALFLIGHT_CLEARCOAT
    l.coat_alpha = ggx_alpha(m.coat_roughness);
#endif
    l.rough_direction = vec3(0.0);
    l.alpha_across = l.alpha;
    l.film = m.iridescence;
    l.film_ior = m.film_ior;
    l.film_thickness = m.film_thickness + m.film_thickness_range;
    l.film_f0 = min(m.dielectric_f0 * m.specular_color, vec3(1.0));
#ifdef HALFLIGHT_ANISOTROPY
    float alpha_along = mix(m.roughness * m.roughness, 1.0, m.anisotropy * m.anisotropy);
    if (m.anisotropy > 0.0 && alpha_along >= kMirrorAlpha) {
        l.rough_direction = m.rough_direction;
        l.alpha_across = max(l.alpha, kMirrorAlpha);
        l.alpha = alpha_along;
    }
#endif
    return l;
}

// Folds the factors that depend on wo alone into the BSDF at a surface.
Bsdf make_bsdf(Material m, vec3 geometric_normal, vec3 wo) {
    Layers layers = layers_of(m, geometric_normal);
    precise Bsdf b;  // precise: code of lobes that the material lacks must not change bits of others
    b.geometric_normal = geometric_normal;
    b.normal = m.normal;
    b.coat_normal = m.coat_normal;
    b.alpha = layers.alpha;
    b.specular = vec3(0.0);
    b.specular_edge = vec3(0.0);
    b.transmission = vec3(0.0);
    b.coat = 0.0;
    b.coat_alpha = layers.coat_alpha;
    b.p_diffuse = 1.0;
    b.p_transmission = 0.0;
    b.p_coat = 0.0;
    b.sheen = vec3(0.0);
    b.sheen_alpha = 1.0;
    b.p_sheen = 0.0;
    b.rough_direction = layers.rough_direction;
    b.alpha_across = layers.alpha_across;
    b.film_dielectric = vec3(0.0);
    b.film_metal = vec3(0.0);
    b.film_ior = layers.film_ior;
    b.film_thickness = layers.film_thickness;
    b.film_dielectric_f0 = layers.film_f0;
    b.film_metal_f0 = m.base_color;
    make_thin(b);
    b.diffuse = (1.0 - m.metallic) * m.base_color;
    b.diffuse_through = vec3(0.0);
    b.p_through = 0.0;
#ifdef HALFLIGHT_DIFFUSE_TRANSMISSION
    b.diffuse_through = (1.0 - m.metallic) * m.diffuse_transmission * m.diffuse_transmission_color;
#endif
#ifdef HALFLIGHT_GLOSSY
    vec2 albedo = specular_albedo(layers, wo);
    float whole = albedo.x + albedo.y;  // E_1
    vec3 f0 = dielectric_f0(m);
    vec3 gain = (1.0 - m.metallic) * multiple_scattering_gain(f0, whole);
#ifdef HALFLIGHT_VOLUME
    bool solid = is_solid(m);
    float solid_share = solid ? m.transmission : 0.0;
    gain *= 1.0 - solid_share;
#endif
    vec3 metal_gain = m.metallic * multiple_scattering_gain(m.base_color, whole);
    b.specular = metal_gain * m.base_color + gain * f0;
    b.specular_edge = metal_gain * (1.0 - m.base_color) + gain * (m.specular - f0);
    float below_layers = 1.0;
#ifdef HALFLIGHT_IRIDESCENCE
    FilmWaves mean_waves = mean_film_waves(layers, albedo);
    vec3 film_of_dielectric = film_reflectance(mean_waves, b.film_dielectric_f0);
    vec3 film_of_metal = film_reflectance(mean_waves, b.film_metal_f0);
    float on_dielectric = (1.0 - m.metallic) * m.iridescence * m.specular;
#ifdef HALFLIGHT_VOLUME
    on_dielectric *= 1.0 - solid_share;
#endif
    b.film_dielectric = on_dielectric * multiple_scattering_gain(film_of_dielectric, whole);
    b.film_metal = m.metallic * m.iridescence * multiple_scattering_gain(film_of_metal, whole);
    b.specular *= 1.0 - m.iridescence;
    b.specular_edge *= 1.0 - m.iridescence;
#endif

    float below_specular = specular_share(layers, albedo);
    b.diffuse *= below_specular;
    b.diffuse_through *= below_specular;
#ifdef HALFLIGHT_SHEEN
    float sheen_whole = sheen_albedo(dot(m.normal, wo), layers.sheen_roughness);
    float below_sheen = sheen_share(layers, sheen_whole);
    b.diffuse *= below_sheen;
    b.diffuse_through *= below_sheen;
    b.specular *= below_sheen;
    b.specular_edge *= below_sheen;
    b.film_dielectric *= below_sheen;
    b.film_metal *= below_sheen;
    below_layers *= below_sheen;
    b.sheen = m.sheen_color / max(sheen_whole, 1.0);
    b.sheen_alpha = layers.sheen_roughness * layers.sheen_roughness;
#endif
    float coat_albedo = 0.0;
#ifdef HALFLIGHT_CLEARCOAT
    b.coat_normal = reflecting_normal(m.coat_normal, layers.horizon, wo);
    vec2 coat = coat_reflection(layers, wo);
    b.coat = coat.x;
    coat_albedo = coat.y;
    b.diffuse *= 1.0 - coat_albedo;
    b.diffuse_through *= 1.0 - coat_albedo;
    b.specular *= 1.0 - coat_albedo;
    b.specular_edge *= 1.0 - coat_albedo;
    b.film_dielectric *= 1.0 - coat_albedo;
    b.film_metal *= 1.0 - coat_albedo;
    below_layers *= 1.0 - coat_albedo;
    b.sheen *= 1.0 - coat_albedo;
#endif
    float transmission = 0.0;
#ifdef HALFLIGHT_TRANSMISSION
    b.transmission = b.diffuse * (m.transmission / whole);
    b.diffuse *= 1.0 - m.transmission;
    b.diffuse_through *= 1.0 - m.transmission;
    transmission = average(b.transmission) * whole;
#endif
#ifdef HALFLIGHT_VOLUME
    if (solid) {
        float root = min(sqrt(m.dielectric_f0), 0.998);  // an index of refraction up to 999
        float ior = (1.0 + root) / (1.0 - root);
        float factor = solid_share * (1.0 - m.metallic) * below_layers;
#ifdef HALFLIGHT_DISPERSION
        b.disperses = m.dispersion > 0.0 && solid_share > 0.0 && ior > 1.0;
        ior = clamp(ior + (ior - 1.0) * 0.025 * m.dispersion * float(m.channel - 1), 1.0, 999.0);
#endif
        b.eta = m.front ? ior : 1.0 / ior;
        b.transmission = factor * m.base_color;
        b.solid_reflection = vec3(factor);
        if (m.front) {
            vec3 strength = min(m.specular * m.specular_color, vec3(1.0));
            b.solid_specular = max(strength.r, max(strength.g, strength.b));
            b.solid_reflection = factor * (strength / max(b.solid_specular, 1e-20));
        }
        b.absorption = m.absorption;
        b.thickness = m.front ? m.thickness : -m.thickness;
        float mu = dot(m.normal, wo);
        b.solid_gain = is_solid_mirror(b) ? 1.0 : 1.0 / solid_albedo(mu, b.alpha_across, b.eta, b.solid_specular);
        transmission = average(max(b.transmission, b.solid_reflection));
    }
#endif
#endif
#ifdef HALFLIGHT_DIFFUSE_TRANSMISSION
    b.diffuse *= 1.0 - m.diffuse_transmission;
#endif
    float diffuse = average(b.diffuse);
#ifdef HALFLIGHT_DIFFUSE_TRANSMISSION
    float through = average(b.diffuse_through);
    diffuse += through;
    b.p_through = through > 0.0 ? through / diffuse : 0.0;
#endif
#ifdef HALFLIGHT_GLOSSY
    float specular = average(b.specular * whole + b.specular_edge * albedo.y);
#ifdef HALFLIGHT_IRIDESCENCE
    // The bound covers lobes that reflect more beside the mean cosine, where interference leaves little.
    specular += average(b.film_dielectric * max(film_of_dielectric, 0.05) + b.film_metal * max(film_of_metal, 0.05)) *
                whole;
#endif
    float glossy = specular + transmission + coat_albedo;
#ifdef HALFLIGHT_SHEEN
    float sheen = average(b.sheen) * max(sheen_whole, 1e-3);  // the bound covers errors of the table
    glossy += sheen;
    b.p_sheen = glossy > 0.0 ? sheen / glossy : 0.0;
#endif
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
#endif

// --- Evaluation and sampling ----------------------------------------------------------------------------------------

#ifdef HALFLIGHT_IRIDESCENCE
// Returns the part of the specular lobe's factor that the film adds, at x = dot(wo, h).
vec3 film_reflection(Bsdf b, float x) {
    FilmWaves waves = film_waves(b.film_ior, b.film_thickness, x);
    return b.film_dielectric * film_reflectance(waves, b.film_dielectric_f0) +
           b.film_metal * film_reflectance(waves, b.film_metal_f0);
}
#endif

// Returns the normal of the specular lobe and of thin transmission. Solids keep n.
vec3 base_normal(Bsdf b, vec3 wo) {
#ifdef HALFLIGHT_GLOSSY
    return b.eta > 0.0 ? b.normal : reflecting_normal(b.normal, b.geometric_normal, wo);
#else
    return b.normal;
#endif
}

// Returns the reflectance below the coat, with the Fresnel terms of normal incidence. The factors of rough lobes contain
// the gain for multiple scattering, so they are multiplied by the lobe's albedo. Only a film may exceed 1.
vec3 reflectance(Bsdf b, vec3 wo) {
    vec3 sum = b.diffuse;
#ifdef HALFLIGHT_DIFFUSE_TRANSMISSION
    sum += b.diffuse_through;
#endif
#ifdef HALFLIGHT_GLOSSY
    vec3 n = base_normal(b, wo);
    vec2 albedo = ggx_albedo(dot(n, wo), b.alpha);
#ifdef HALFLIGHT_ANISOTROPY
    if (b.alpha != b.alpha_across)
        albedo = ggx_albedo(wo * bent_basis(b.normal, b.rough_direction, n), vec2(b.alpha, b.alpha_across));
#endif
    float whole = b.alpha > 0.0 ? albedo.x + albedo.y : 1.0;
    sum += b.specular * whole + b.transmission * (b.eta > 0.0 ? 1.0 : whole);
#ifdef HALFLIGHT_IRIDESCENCE
    sum += film_reflection(b, 1.0) * whole;
#endif
#endif
    return sum;
}

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
#ifdef HALFLIGHT_DIFFUSE
    value.pdf_diffuse = reflected ? side_n * 0.318309886184 : 0.0;
    value.diffuse = b.diffuse * value.pdf_diffuse;
#ifdef HALFLIGHT_DIFFUSE_TRANSMISSION
    bool passes = side_g < 0.0 && side_n < 0.0;
    float lambert = passes ? side_n * -0.318309886184 : value.pdf_diffuse;
    value.diffuse = (passes ? b.diffuse_through : b.diffuse) * lambert;
    value.pdf_diffuse = (passes ? b.p_through : 1.0 - b.p_through) * lambert;
#endif
#endif
    value.glossy = vec3(0.0);
    value.pdf_glossy = 0.0;
#ifdef HALFLIGHT_GLOSSY
    vec3 n = base_normal(b, wo);
    side_n = dot(n, wi);
    bool base_reflects = side_g > 0.0 && side_n > 0.0;
    bool lobe = base_reflects;
    vec3 scale = b.specular;
    vec3 edge = b.specular_edge;
    float p = p_specular(b);
    vec3 folded = wi;
#ifdef HALFLIGHT_TRANSMISSION
    bool transmitted = b.eta == 0.0 && side_g < 0.0 && side_n < 0.0;
    lobe = lobe || transmitted;
    scale = transmitted ? b.transmission : scale;
    edge = transmitted ? vec3(0.0) : edge;
    p = transmitted ? b.p_transmission : p;
    folded = transmitted ? wi - 2.0 * side_n * n : wi;
#endif
    if (lobe && b.alpha > 0.0) {
        GgxValue ggx = ggx_evaluate(n, b.alpha, wo, folded);
#ifdef HALFLIGHT_ANISOTROPY
        if (b.alpha != b.alpha_across)
            ggx = ggx_evaluate(bent_basis(b.normal, b.rough_direction, n), vec2(b.alpha, b.alpha_across), wo, folded);
#endif
        value.glossy = ggx.scattered * (scale + edge * ggx.schlick);
#ifdef HALFLIGHT_IRIDESCENCE
        vec3 film = film_reflection(b, ggx.x);
#ifdef HALFLIGHT_TRANSMISSION
        film = transmitted ? vec3(0.0) : film;
#endif
        value.glossy += ggx.scattered * film;
#endif
        value.pdf_glossy = p * ggx.pdf;
    }
#ifdef HALFLIGHT_VOLUME
    if (b.eta > 0.0 && !is_solid_mirror(b)) {
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
#endif
#ifdef HALFLIGHT_CLEARCOAT
    if (b.coat > 0.0 && b.coat_alpha > 0.0 && side_g > 0.0 && dot(b.coat_normal, wi) > 0.0) {
        GgxValue ggx = ggx_evaluate(b.coat_normal, b.coat_alpha, wo, wi);
        value.glossy += vec3(ggx.scattered * b.coat * mix(ggx.schlick, 1.0, kCoatF0)) * b.coat_tint;
        value.pdf_glossy += b.p_coat * ggx.pdf;
    }
#endif
#ifdef HALFLIGHT_SHEEN
    if (reflected && b.sheen != vec3(0.0)) {
        value.glossy += b.sheen * sheen_scattered(b.normal, b.sheen_alpha, wo, wi);
        value.pdf_glossy += b.p_sheen * sheen_pdf(dot(b.normal, wi), b.sheen_alpha);
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

// Samples a diffuse direction. `choice`, uniform in [0, 1), selects reflection or transmission.
BsdfSample sample_diffuse(Bsdf b, vec3 wo, vec2 xi, float choice) {
    vec3 local = sample_cosine(xi);
    BsdfSample s;
#ifdef HALFLIGHT_DIFFUSE_TRANSMISSION
    if (choice < b.p_through) {
        s.direction = basis_around(b.normal) * -local;
        bool passes = local.z > 0.0 && dot(s.direction, b.geometric_normal) < 0.0;
        s.pdf = passes ? local.z * 0.318309886184 * b.p_through : 0.0;
        s.weight = passes ? b.diffuse_through / b.p_through : vec3(0.0);
        return s;
    }
#endif
    s.direction = basis_around(b.normal) * local;
    bool usable = local.z > 0.0 && dot(s.direction, b.geometric_normal) > 0.0;
    s.pdf = usable ? local.z * 0.318309886184 : 0.0;
    s.weight = usable ? b.diffuse : vec3(0.0);
#ifdef HALFLIGHT_DIFFUSE_TRANSMISSION
    s.pdf *= 1.0 - b.p_through;
    s.weight /= 1.0 - b.p_through;
#endif
    return s;
}

#ifdef HALFLIGHT_VOLUME
// Returns the direction that a microfacet reflects or refracts. `split`, uniform in [0, 1), decides which.
vec3 solid_direction(Bsdf b, vec3 wo, vec3 facet, float split, out bool refracted) {
    float x = dot(wo, facet);
    refracted = split >= solid_fresnel(b, clamp(x, 0.0, 1.0));
    return refracted ? refracted_direction(wo, facet, b.eta) : normalize(2.0 * x * facet - wo);
}
#endif

// Samples a glossy direction. `choice`, uniform in [0, 1), selects specular, transmission, coat or sheen.
BsdfSample sample_glossy(Bsdf b, vec3 wo, vec2 xi, float choice) {
    bool coat = false;
    bool transmitted = false;
    vec3 n = base_normal(b, wo);
    vec2 alpha = vec2(b.alpha);
    float p = p_specular(b);
#ifdef HALFLIGHT_CLEARCOAT
    coat = choice < b.p_coat;
    n = coat ? b.coat_normal : n;
    alpha = coat ? vec2(b.coat_alpha) : alpha;
    p = coat ? b.p_coat : p;
#endif
#ifdef HALFLIGHT_TRANSMISSION
    transmitted = !coat && choice < b.p_coat + b.p_transmission;
    p = transmitted ? b.p_transmission : p;
#endif
    bool sheen = false;
#ifdef HALFLIGHT_SHEEN
    sheen = !coat && !transmitted && choice < b.p_coat + b.p_transmission + b.p_sheen;
#endif
    bool mirror = alpha.x == 0.0 && !sheen;
#ifdef HALFLIGHT_SHEEN
    n = sheen ? b.normal : n;
#endif
    mat3 basis = basis_around(n);
#ifdef HALFLIGHT_ANISOTROPY
    if (!coat && b.alpha != b.alpha_across) {
        bool solid_lobe = transmitted && b.eta > 0.0;  // isotropic
        alpha = solid_lobe ? vec2(b.alpha_across) : vec2(b.alpha, b.alpha_across);
        basis = solid_lobe ? basis : bent_basis(b.normal, b.rough_direction, n);
    }
#endif
    vec3 wo_local = wo * basis;
    wo_local.z = max(wo_local.z, 1e-20);  // bent normals face wo; the bound covers rounding of the product
    vec3 h = mirror ? vec3(0.0, 0.0, 1.0) : sample_visible_normal(wo_local, alpha, xi);
    float x = dot(wo_local, h);
    vec3 local = 2.0 * x * h - wo_local;
#ifdef HALFLIGHT_SHEEN
    local = sheen ? sample_sheen(b.sheen_alpha, xi) : local;
#endif
    bool usable = local.z > 0.0;
    local.z = transmitted ? -local.z : local.z;
    vec3 wi = normalize(basis * local);
    float side_g = dot(wi, b.geometric_normal);
    usable = usable && (transmitted ? side_g < 0.0 : side_g > 0.0);
#ifdef HALFLIGHT_VOLUME
    bool solid = transmitted && b.eta > 0.0;
    bool solid_mirror = solid && is_solid_mirror(b);
    bool refracted = false;
    if (solid) {
        mirror = solid_mirror;
        float split = clamp((choice - b.p_coat) / b.p_transmission, 0.0, 1.0);
        vec3 facet = mirror ? n : basis * h;
        wi = solid_direction(b, wo, facet, split, refracted);
        // Mirrors that would send light to the wrong side of the surface do without their shading normal.
        if (mirror && (dot(wi, b.geometric_normal) < 0.0) != refracted)
            wi = solid_direction(b, wo, b.geometric_normal, split, refracted);
        float away = refracted ? -1.0 : 1.0;
        usable = away * dot(wi, b.geometric_normal) > 0.0 && (mirror || away * dot(wi, n) > 0.0);
    }
#endif

    BsdfSample s;
    s.direction = wi;
    BsdfValue value = evaluate_bsdf(b, wo, wi);
    s.pdf = usable ? value.pdf_glossy : 0.0;
    s.weight = s.pdf > 0.0 ? value.glossy / s.pdf : vec3(0.0);
#ifdef HALFLIGHT_VOLUME
    if (solid_mirror) {
        s.pdf = 0.0;
        s.weight = usable && p > 0.0 ? (refracted ? b.transmission : b.solid_reflection) / p : vec3(0.0);
        return s;
    }
#endif
    if (mirror) {
        float schlick = pow5(1.0 - clamp(x, 0.0, 1.0));
        vec3 reflectance = coat          ? vec3(b.coat * mix(schlick, 1.0, kCoatF0)) * b.coat_tint
                           : transmitted ? b.transmission
                                         : b.specular + b.specular_edge * schlick;
#ifdef HALFLIGHT_IRIDESCENCE
        if (!coat && !transmitted) reflectance += film_reflection(b, x);
#endif
        s.pdf = 0.0;
        s.weight = usable && p > 0.0 ? reflectance / p : vec3(0.0);
    }
    return s;
}
