// Traces a batch of rays through the pages that are in memory. Rays that met a missing page earlier than their hit go
// into the list `waiting`. Such rays are traced again, from the root, once the page is there. What they have found so
// far stays valid, because hits do not depend on the order of the search. A ray waits for the first page that it has
// not searched, in an order of its own (shaders/lib/traverse.glsl). Pages before it need not stay, so rays get on even
// if the pool has a single slot.
//
// Variants: HALFLIGHT_ANY_HIT, HALFLIGHT_LIST as of shaders/trace.comp; HALFLIGHT_TOUCH (notes the slots in use).
#include "shaders/trace_scene.glsl"
#include "shaders/lib/batch_rays.glsl"

#if HALFLIGHT_TOUCH
layout(std430) writeonly buffer Touched { uint touched_slots[]; };
#endif
uniform uint top;  // texel of the head of the hierarchy over all pages, whose root follows
#define TRAVERSAL_HEAD top
#define TRAVERSAL_ROOT (top + uint(kBvhPageTexels))
#include "shaders/lib/traverse.glsl"

layout(local_size_x = 64) in;

#if HALFLIGHT_ANY_HIT
layout(std430) buffer Occluded { uint occluded[]; };
#else
layout(std430) buffer Hits { Hit hits[]; };
#endif
#if HALFLIGHT_LIST
layout(std430) readonly buffer List { uint list[]; };
layout(std430) readonly buffer Header { ListHeader header; };
#endif
layout(std430) buffer Waiting { uint waiting[]; };
layout(std430) buffer WaitingHeader { ListHeader waiting_header; };
layout(std430) buffer Fronts { uvec2 fronts[]; };         // per waiting ray: entry and root of what it waits for
layout(std430) buffer Wanted { uint rays_that_want[]; };  // per root, number of waiting rays

uniform usamplerBuffer shown_roots;  // per root, 1: its page is there
uniform bool again;                  // true: the rays have been traced before
uniform uint group_stride;           // one work group in so many traces its rays

void main() {
    if (gl_WorkGroupID.x % group_stride != 0u) return;
    uint path = gl_GlobalInvocationID.x;
#if HALFLIGHT_LIST
    if (path >= header.count) return;
    path = list[path];
#endif
    bool still_waits = false;
    if (again) {
        searched = fronts[path];
        still_waits = texelFetch(shown_roots, int(searched.y)).x == 0u;
    }
    Ray ray = load_ray(path);
    stack[0] = TRAVERSAL_ROOT;
    stack_near[0] = floatBitsToInt(ray.t_min);
    int entries = ray.t_max >= ray.t_min && !still_waits ? 1 : 0;
#if HALFLIGHT_ANY_HIT
    Hit hit = traverse_from(ray, entries, no_hit(), alpha_key(path), true);
    bool finished = floatBitsToUint(hit.t) != floatBitsToUint(not_a_number());
    occluded[path] = hit.triangle == kMiss ? kFree : finished ? kOccluded : kUnfinished;
    bool waits = first_missing.y != kMiss && hit.triangle == kMiss;
#else
    Hit known = no_hit();
    if (again) known = hits[path];
    Hit hit = traverse_from(ray, entries, known, alpha_key(path), false);
    hits[path] = hit;
    int end = floatBitsToInt(hit.t);  // above kBvhFar: NaN
    bool waits = first_missing.y != kMiss && int(first_missing.x) <= end && end <= kBvhFar;
#endif
    if (still_waits) first_missing = searched;
    if (waits || still_waits) {
        uint place = atomicAdd(waiting_header.count, 1u);
        if ((place & 63u) == 0u) atomicAdd(waiting_header.groups_x, 1u);
        waiting[place] = path;
        fronts[path] = first_missing;
        atomicAdd(rays_that_want[first_missing.y], 1u);
    }
}
