// Traces a batch of rays through the pages that are in memory. Rays that met a missing page earlier than their hit go
// into the list `waiting`. Such rays are traced again, from the root, once the page is there. What they have found so
// far stays valid, because hits do not depend on the order of the search. A ray waits for the first page that it has
// not searched, in an order of its own (shaders/lib/traverse.glsl). Pages before it need not stay, so rays get on even
// if the pool has a single slot.
//
// HALFLIGHT_TOUCH: notes the slots in use.
#include "shaders/trace_scene.glsl"
#include "shaders/lib/batch_answers.glsl"
#include "shaders/lib/batch_paths.glsl"
#include "shaders/lib/batch_rays.glsl"
#include "shaders/lib/traverse.glsl"

layout(local_size_x = 64) in;

layout(std430) buffer Waiting { uint waiting[]; };
layout(std430) buffer WaitingHeader { ListHeader waiting_header; };
layout(std430) buffer Fronts { uvec2 fronts[]; };         // per waiting ray: entry and root of what it waits for
layout(std430) buffer Wanted { uint rays_that_want[]; };  // per root, number of waiting rays

uniform usamplerBuffer shown_roots;  // per root, 1: its page is there
uniform bool again;                  // true: the rays have been traced before
uniform uint group_stride;           // one work group in so many traces its rays

void main() {
    if (gl_WorkGroupID.x % group_stride != 0u) return;
    uint entry = gl_GlobalInvocationID.x;
    if (kListed && entry >= entry_count()) return;
    uint path = path_of(entry);
    bool still_waits = false;
    if (again) {
        searched = fronts[path];
        still_waits = texelFetch(shown_roots, int(searched.y)).x == 0u;
    }
    Ray ray = load_ray(path);
    stack[0] = top_root();
    stack_near[0] = floatBitsToInt(ray.t_min);
    int entries = ray.t_max >= ray.t_min && !still_waits ? 1 : 0;
    Hit known = no_hit();
    if (!kAnyHit && again) known = hits[path];
    Hit hit = traverse_from(ray, entries, known, alpha_sampler(path), kAnyHit);
    store_answer(path, hit);
    int end = floatBitsToInt(hit.t);  // above kBvhFar: NaN
    bool waits = first_missing.y != kMiss &&
                 (kAnyHit ? hit.triangle == kMiss : int(first_missing.x) <= end && end <= kBvhFar);
    if (still_waits) first_missing = searched;
    if (waits || still_waits) {
        uint place = atomicAdd(waiting_header.count, 1u);
        if ((place & 63u) == 0u) atomicAdd(waiting_header.groups_x, 1u);
        waiting[place] = path;
        fronts[path] = first_missing;
        atomicAdd(rays_that_want[first_missing.y], 1u);
    }
}
