// Traces a batch of rays. HALFLIGHT_ANY_HIT: tests whether there is any hit. HALFLIGHT_LIST: traces listed paths only.
#include "shaders/trace_scene.glsl"
#include "shaders/lib/batch_rays.glsl"
#include "shaders/lib/traverse.glsl"

layout(local_size_x = 64) in;

#if HALFLIGHT_ANY_HIT
layout(std430) writeonly buffer Occluded { uint occluded[]; };
#else
layout(std430) writeonly buffer Hits { Hit hits[]; };
#endif
#if HALFLIGHT_LIST
layout(std430) readonly buffer List { uint list[]; };
layout(std430) readonly buffer Header { ListHeader header; };
#endif

void main() {
    uint path = gl_GlobalInvocationID.x;
#if HALFLIGHT_LIST
    if (path >= header.count) return;
    path = list[path];
#endif
    uint key = alpha_key(path);
#if HALFLIGHT_ANY_HIT
    Hit hit = traverse(load_ray(path), key, true);
    occluded[path] = hit.triangle == kMiss ? kFree : floatBitsToUint(hit.t) != floatBitsToUint(not_a_number()) ? kOccluded : kUnfinished;
#else
    hits[path] = traverse(load_ray(path), key, false);
#endif
}
