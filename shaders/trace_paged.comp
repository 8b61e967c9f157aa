// Traces a batch of rays through the pages that are in memory. Rays that met a missing page earlier than their hit go
// into the list `waiting`, and the page's subtree into `requests`. Such rays are traced again, from the root, once the
// page is there. What they have found so far stays valid, because hits do not depend on the order of the search.
//
// Variants: HALFLIGHT_ANY_HIT, HALFLIGHT_LIST as of shaders/trace.comp.
#include "shaders/trace_scene.glsl"
#include "shaders/lib/batch_rays.glsl"
#include "shaders/lib/traverse.glsl"

layout(local_size_x = 64) in;

#ifdef HALFLIGHT_ANY_HIT
layout(std430) buffer Occluded { uint occluded[]; };
#else
layout(std430) buffer Hits { Hit hits[]; };
#endif
#ifdef HALFLIGHT_LIST
layout(std430) readonly buffer List { uint list[]; };
layout(std430) readonly buffer Header { ListHeader header; };
#endif
layout(std430) buffer Waiting { uint waiting[]; };
layout(std430) buffer WaitingHeader { ListHeader waiting_header; };
layout(std430) buffer Requests { uint request_count; uint requests[]; };  // roots, each at most once
layout(std430) buffer Wanted { uint rays_that_want[]; };                  // per root, number of waiting rays

uniform bool again;  // true: the rays have been traced before

void main() {
    uint path = gl_GlobalInvocationID.x;
#ifdef HALFLIGHT_LIST
    if (path >= header.count) return;
    path = list[path];
#endif
#ifdef HALFLIGHT_ANY_HIT
    if (again && occluded[path] != kFree) return;
#endif
    Ray ray = load_ray(path);
    stack[0] = TRAVERSAL_ROOT;
    stack_near[0] = floatBitsToInt(ray.t_min);
    int entries = ray.t_max >= ray.t_min ? 1 : 0;
#ifdef HALFLIGHT_ANY_HIT
    Hit hit = traverse_from(ray, entries, kNoHit, alpha_key(path), true);
    bool finished = floatBitsToUint(hit.t) != floatBitsToUint(not_a_number());
    occluded[path] = hit.triangle == kMiss ? kFree : finished ? kOccluded : kUnfinished;
    bool waits = missing_root != kMiss && hit.triangle == kMiss;
#else
    Hit known = kNoHit;
    if (again) known = hits[path];
    Hit hit = traverse_from(ray, entries, known, alpha_key(path), false);
    hits[path] = hit;
    int end = floatBitsToInt(hit.t);  // above kBvhFar: NaN
    bool waits = missing_root != kMiss && missing_near <= end && end <= kBvhFar;
#endif
    if (waits) {
        uint place = atomicAdd(waiting_header.count, 1u);
        if ((place & 63u) == 0u) atomicAdd(waiting_header.groups_x, 1u);
        waiting[place] = path;
        if (atomicAdd(rays_that_want[missing_root], 1u) == 0u) requests[atomicAdd(request_count, 1u)] = missing_root;
    }
}
