// Finds the panes that the listed rays of a batch meet, one by one, and the light that passes them (SHADING.md, Panes).
// The hierarchies are those over the panes alone.
#include "shaders/trace_scene.glsl"
#include "shaders/lib/batch_rays.glsl"
#include "shaders/lib/traverse.glsl"
#include "shaders/lib/material.glsl"
#include "shaders/lib/bsdf.glsl"
#include "shaders/lib/occlusion.glsl"
#include "shaders/lib/panes.glsl"
#include "shaders/lib/sized_lights.glsl"
#include "shaders/shared/path_state.h"
#include "shaders/shared/reuse_groups.h"

layout(local_size_x = 64) in;

// Rays that pass panes by chance before their hits, which become the panes if they do not. Otherwise, shadow rays, of
// which those that are free pass all panes.
const bool kScattered = HALFLIGHT_SCATTERED != 0;

layout(std430) readonly buffer List { uint list[]; };
layout(std430) readonly buffer Header { ListHeader header; };
OPTIONAL(!HALFLIGHT_SCATTERED) layout(std430) buffer Occluded { uint occluded[]; };
OPTIONAL(HALFLIGHT_SCATTERED) layout(std430) buffer Hits { Hit hits[]; };
OPTIONAL(HALFLIGHT_SCATTERED) layout(std430) buffer States { PathState states[]; };
OPTIONAL(HALFLIGHT_SCATTERED && HALFLIGHT_SIZED_LIGHTS) layout(std430) buffer MetLamps { MetLamp met_lamps[]; };

uniform samplerBuffer media;  // RGBA32F: media of scattered rays, with solid panes

// Panes on a ray, at most. Rays through more count as unfinished.
const uint kMostPanes = 255u;

void main() {
    uint path = gl_GlobalInvocationID.x;
    if (path >= header.count) return;
    path = list[path];
    Ray ray = load_ray(path);
    Sampler random = alpha_sampler(path);
    if (kScattered) ray.t_max = min(ray.t_max, hits[path].t);
    bool stops = false;
    vec3 direction = normalize(ray.direction);
    vec3 share = vec3(1.0);
    uint panes = 0u;  // panes passed
    float unit = length(ray.direction);
    uint link_set = kShadowLinks && !kScattered ? set_of_shadow_ray(ray.t_min) : 0u;
    SolidPanes solids = SolidPanes(is_marked_start(ray.t_min), 0u, vec3(0.0), vec3(0.0), 0.0);
    if (kScattered && kSolidPanes) solids.began_inside = endless_way(texelFetch(media, int(path))) > 0.0;
    // Mirrors and clear glass show solids bent.
    bool bends = false;
    if (kScattered && kSolidPanes) bends = states[path].pdf == 0.0;
    bool by_chance = false;  // the ray stops at a pane that it might have passed
    bool goes_on = false;
    do {
        Hit hit = traverse(ray, random, false);
        goes_on = hit.triangle != kMiss;
        bool finished = finite(hit.t) || !goes_on;
        // A miss looks up triangle 0, too, because the lanes of a register cannot diverge. The result is not used.
        hit.triangle = goes_on ? hit.triangle : 0u;
        hit.instance = goes_on ? hit.instance : 0u;
        Surface surface = surface_at(hit, ray.direction);
        Material material = evaluate_material(surface, -direction);
        material.channel = 0;  // panes do not disperse
        Bsdf b = make_bsdf(material, surface.geometric_normal, -direction);
        vec3 passed = straight_transmission(b, -direction);
        bool leaves = kSolidPanes && b.thickness < 0.0;
        bool has_entered = solids.entered > 0u;
        if (kSolidPanes && ((leaves && !has_entered && solids.began_inside) || (bends && b.eta > 0.0)))
            passed = vec3(0.0);
        bool is_linked = true;
        if (kShadowLinks && !kScattered) is_linked = blocks_light(link_set, class_of_object(hit.triangle, hit.instance));
        if (!is_linked) passed = vec3(1.0);
        if (kScattered) {
            // Rays that have entered a solid pass its other side, too.
            float chance = leaves && has_entered && passed != vec3(0.0) ? 1.0 : pane_chance(passed);
            stops = goes_on && finished && sample_1d(random, panes) >= chance;
            by_chance = stops && chance > 0.0;
            if (stops) {
                hit.triangle = triangle_id(hit.triangle);
                hits[path] = hit;
                ray.t_max = hit.t;
            }
            goes_on = goes_on && !stops;
            passed /= max(chance, 1e-30);
        }
        if (kSolidPanes && kScattered && kSizedLights && goes_on && finished && solids.entered > 0u &&
            met_lamps[path].distance > solids.from && met_lamps[path].distance <= hit.t * unit)
            met_lamps[path].light *= transmittance_to_end(solids, met_lamps[path].distance);  // the lamp is inside
        if (kSolidPanes && goes_on && finished && is_linked) passed *= pass_surface(solids, b, hit.t * unit);
        if (kScattered && kSizedLights && (stops || goes_on) && hit.t * unit < met_lamps[path].distance)
            met_lamps[path].light *= stops ? vec3(0.0) : passed;
        share = goes_on ? share * passed : share;
        panes += goes_on ? 1u : 0u;
        if (!finished || panes > kMostPanes) {
            share = vec3(not_a_number());
            goes_on = false;
            if (kScattered && kSizedLights) met_lamps[path].light = share;  // behind panes that were not counted
        }
        // A ray that leaves the pane starts behind its error bound. What is nearer is the same pane: files have faces
        // for both of its sides.
        float along = max(abs(dot(surface.geometric_normal, ray.direction)), 1e-6 * length(ray.direction));
        ray.t_min = goes_on ? hit.t + surface.offset / along : ray.t_min;
    } while (goes_on && share != vec3(0.0));

    if (kSolidPanes && solids.entered > 0u) {  // the ray ends inside
        if (kScattered && kSizedLights && met_lamps[path].distance > solids.from)
            met_lamps[path].light *= transmittance_to_end(solids, met_lamps[path].distance);
        share *= transmittance_to_end(solids, ray.t_max * unit);
    }
    if (kScattered && kSolidPanes)
        states[path].reuse = (states[path].reuse & ~kReuseMetByChance) | (by_chance ? kReuseMetByChance : 0u);
    if (panes == 0u && share == vec3(1.0)) return;
    if (kScattered) {
        states[path].throughput *= share;
        states[path].reuse |= kReuseThroughPane;
    } else if (any(isnan(share))) {
        occluded[path] = kUnfinished;
    } else {
        vec3 dither = vec3(sample_1d(random, 0u), sample_1d(random, 1u), sample_1d(random, 2u));
        occluded[path] = answer_of_panes(share, dither);
    }
}
