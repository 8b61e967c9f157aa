// Finds the light that the rays of a batch have passed through panes (SHADING.md, Panes), pane by pane, in the
// hierarchies over the panes alone.
//
// Variants: HALFLIGHT_SCATTERED (rays that pass panes by chance before their hits, which become the panes where they do
// not; otherwise shadow rays, of which those that are free pass all panes), HALFLIGHT_LIST (of the listed paths),
// HALFLIGHT_SELECT (only lists the rays that meet one of the root's boxes: software drivers run the whole kernel for rays
// that meet nothing).
#include "shaders/trace_scene.glsl"
#if HALFLIGHT_SELECT
#include "shaders/lib/bvh.glsl"
#include "shaders/lib/ray_texels.glsl"
#else
#include "shaders/lib/batch_rays.glsl"
#include "shaders/lib/traverse.glsl"
#include "shaders/lib/material.glsl"
#include "shaders/lib/bsdf.glsl"
#include "shaders/lib/occlusion.glsl"
#endif
#include "shaders/shared/path_state.h"
#include "shaders/shared/reuse_groups.h"

layout(local_size_x = 64) in;

#if HALFLIGHT_LIST || !HALFLIGHT_SELECT
layout(std430) readonly buffer List { uint list[]; };
layout(std430) readonly buffer Header { ListHeader header; };
#endif
#if HALFLIGHT_SELECT
#if HALFLIGHT_SCATTERED
#include "shaders/lib/hit_texels.glsl"
#endif
layout(std430) writeonly buffer Selected { uint selected[]; };
layout(std430) buffer SelectedHeader { ListHeader selected_header; };
#if !HALFLIGHT_SCATTERED
uniform usamplerBuffer occluded;  // R32UI: answers to the rays
#endif
#elif HALFLIGHT_SCATTERED
layout(std430) buffer Hits { Hit hits[]; };
layout(std430) buffer States { PathState states[]; };
#if HALFLIGHT_SIZED_LIGHTS
layout(std430) buffer MetLamps { MetLamp met_lamps[]; };
#endif
#else
layout(std430) buffer Occluded { uint occluded[]; };
#endif

// Panes on a ray, at most. Rays through more count as unfinished.
const uint kMostPanes = 255u;

#if HALFLIGHT_SELECT
void main() {
    uint path = gl_GlobalInvocationID.x;
    bool asks = true;
#if HALFLIGHT_LIST
    asks = path < header.count;
    path = list[asks ? path : 0u];
#endif
    Ray ray = load_ray(path);
#if HALFLIGHT_SCATTERED
    ray.t_max = min(ray.t_max, load_hit(path).t);
#else
    asks = asks && texelFetch(occluded, int(path)).x == kFree;
#endif
    BvhHead head = bvh_head(0u);
    BvhStep root = bvh_step(box_ray(ray.origin, ray.direction, head.base, head.cell, head.slack), kBvhTag | 1u, ray.t_min,
                            ray.t_max);
    if (!asks || ray.t_max < ray.t_min || root.near.x == kBvhFar) return;
    uint place = atomicAdd(selected_header.count, 1u);
    if ((place & 63u) == 0u) atomicAdd(selected_header.groups_x, 1u);
    selected[place] = path;
}
#else
void main() {
    uint path = gl_GlobalInvocationID.x;
    if (path >= header.count) return;
    path = list[path];
    Ray ray = load_ray(path);
    uint key = alpha_key(path);
#if HALFLIGHT_SCATTERED
    ray.t_max = min(ray.t_max, hits[path].t);
    bool stops = false;
#endif
    vec3 direction = normalize(ray.direction);
    vec3 share = vec3(1.0);
    uint panes = 0u;  // panes passed
    bool goes_on = false;
    do {
        Hit hit = traverse(ray, key, false);
        goes_on = hit.triangle != kMiss;
        bool finished = finite(hit.t) || !goes_on;
        // A miss looks up triangle 0 in vain, because the lanes of a register cannot diverge.
        hit.triangle = goes_on ? hit.triangle : 0u;
        hit.instance = goes_on ? hit.instance : 0u;
        Surface surface = surface_at(hit, ray.direction);
        Material material = evaluate_material(surface, -direction);
        material.channel = 0;  // panes do not disperse
        vec3 passed = straight_transmission(make_bsdf(material, surface.geometric_normal, -direction));
#if HALFLIGHT_SCATTERED
        float chance = pane_chance(passed);
        stops = goes_on && finished && unit_float(hash_combine(key, panes + 1u)) >= chance;
        if (stops) {
            hit.triangle = triangle_id(hit.triangle);
            hits[path] = hit;
        }
        goes_on = goes_on && !stops;
        passed /= max(chance, 1e-30);
#if HALFLIGHT_SIZED_LIGHTS
        if ((stops || goes_on) && hit.t * length(ray.direction) < met_lamps[path].distance)
            met_lamps[path].light *= stops ? vec3(0.0) : passed;
#endif
#endif
        share = goes_on ? share * passed : share;
        panes += goes_on ? 1u : 0u;
        if (!finished || panes > kMostPanes) {
            share = vec3(not_a_number());
            goes_on = false;
#if HALFLIGHT_SCATTERED && HALFLIGHT_SIZED_LIGHTS
            met_lamps[path].light = share;  // behind panes that were not counted
#endif
        }
        // A ray that leaves the pane starts behind its error bound. What is nearer is the same pane: files have faces
        // for both of its sides.
        float along = max(abs(dot(surface.geometric_normal, ray.direction)), 1e-6 * length(ray.direction));
        ray.t_min = goes_on ? hit.t + surface.offset / along : ray.t_min;
    } while (goes_on && share != vec3(0.0));

    if (panes == 0u && share == vec3(1.0)) return;
#if HALFLIGHT_SCATTERED
    states[path].throughput *= share;
    states[path].reuse |= kReuseThroughPane;
#else
    if (any(isnan(share))) {
        occluded[path] = kUnfinished;
        return;
    }
    uint random = hash_combine(key, 1u);
    vec3 dither = vec3(unit_float(random), unit_float(hash_combine(random, 1u)), unit_float(hash_combine(random, 2u)));
    occluded[path] = answer_of_panes(share, dither);
#endif
}
#endif
