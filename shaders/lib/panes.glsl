// Straight transmission through panes (SHADING.md, Panes).
#include "shaders/lib/medium.glsl"

const bool kSolidPanes = HALFLIGHT_SOLID_PANES != 0;  // solids with straight_shadows are panes

// Returns the share of light that the surface reflects where light passes it straight on into or out of a solid. Light
// inside has the direction of the light outside, so both sides take the Fresnel reflectance from outside.
float straight_reflectance(Bsdf b, vec3 wo) {
    float x = min(abs(dot(b.normal, wo)), 1.0);
    return b.solid_specular * fresnel_dielectric(x, max(b.eta, 1.0 / max(b.eta, 1e-3)));
}

// Returns the share of light that passes the surface straight on.
vec3 straight_transmission(Bsdf b, vec3 wo) {
    vec3 passed = b.alpha == 0.0 && (kSolidPanes || b.eta == 0.0) ? b.transmission : vec3(0.0);
    if (kSolidPanes && b.eta > 0.0) passed *= 1.0 - straight_reflectance(b, wo);
    return passed;
}

// Returns the probability with which a scattered ray passes a pane.
float pane_chance(vec3 straight) { return min(max(straight.r, max(straight.g, straight.b)), kMostPaneChance); }

// Makes the surface of rays that have met a pane instead of passing it. Returns the factor of its light.
float make_met_pane(inout Bsdf b, vec3 wo) {
    vec3 straight = straight_transmission(b, wo);
    float scale = 1.0 / (1.0 - pane_chance(straight));
    if (straight != vec3(0.0)) {
        float others = 1.0 - b.p_transmission;  // probability of the other glossy lobes
        if (kSolidPanes && b.eta > 0.0) {  // the interface becomes a mirror, with the probability of both its sides
            b.specular += b.solid_reflection * straight_reflectance(b, wo);
            b.solid_reflection = vec3(0.0);
            b.eta = b.thickness = 0.0;
            others = 1.0;
        }
        b.transmission = vec3(0.0);
        b.p_transmission = 0.0;
        b.p_coat = others > 0.0 ? min(b.p_coat / others, 1.0) : 0.0;
        b.p_sheen = others > 0.0 ? min(b.p_sheen / others, 1.0) : 0.0;
        float glossy = (1.0 - b.p_diffuse) * others;
        if (kDiffuse) b.p_diffuse = glossy > 0.0 ? b.p_diffuse / (b.p_diffuse + glossy) : 1.0;
    }
    scale_lobes(b, vec3(scale));
    return scale;
}

// Where a ray is on its way through solids that it passes straight on.
struct SolidPanes {
    bool began_inside;  // the ray began inside of a solid, whose surface it meets like any other
    uint entered;       // number of solids that the ray is in, beyond the one that it began in
    vec3 absorption;    // sum of their absorption per world unit
    vec3 endless;       // sum of the optical depths that stand for an endless way inside
    float from;         // distance of the last surface from the ray's origin, world units
};

// Returns the share of light that the solids let through from the last surface to the end of the ray. Light that enters
// an open surface never leaves it, so its way inside is at most the thickness.
vec3 transmittance_to_end(SolidPanes solids, float end) {
    vec3 depth = solids.absorption * min(end - solids.from, 1e30);
    return exp(-min(min(depth, solids.endless), vec3(100.0)));
}

// Takes the ray through a surface at a distance. Returns the share of light that solids absorb on the way to it, and
// behind an open surface that is met from inside.
vec3 pass_surface(inout SolidPanes solids, Bsdf b, float distance) {
    vec3 depth = solids.absorption * (distance - solids.from);
    vec3 endless = b.absorption * abs(b.thickness);
    bool enters = b.thickness > 0.0, leaves = b.thickness < 0.0, open = leaves && solids.entered == 0u;
    if (open) depth += endless;
    if (enters || (leaves && !open)) {
        float side = enters ? 1.0 : -1.0;
        solids.entered += enters ? 1u : 0xffffffffu;
        solids.absorption = max(solids.absorption + side * b.absorption, vec3(0.0));
        solids.endless = max(solids.endless + side * endless, vec3(0.0));
    }
    if (solids.entered == 0u) solids.absorption = solids.endless = vec3(0.0);  // without rounding errors
    solids.from = distance;
    return exp(-min(depth, vec3(100.0)));
}
