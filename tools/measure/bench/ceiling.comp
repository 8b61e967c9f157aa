// The tracer of shaders/trace.comp with perfect culling, an upper bound of the gain of culling. Each ray is given the
// subtree that contains its hit and traverses nothing else. Rays without a hit traverse nothing.
//
// Variants: HALFLIGHT_ANY_HIT, HALFLIGHT_LIST, together with TraceScene::defines().
#include "shaders/shared/ray_structs.h"
#include "shaders/trace_scene.glsl"

layout(local_size_x = 64) in;

uniform samplerBuffer rays;  // RGBA32F, two texels each
uniform usamplerBuffer entries;  // RG32UI: reference, and reference within the block of an instance
#if HALFLIGHT_ANY_HIT
layout(std430) writeonly buffer Occluded { uint occluded[]; };
#else
layout(std430) writeonly buffer Hits { Hit hits[]; };
#endif
#if HALFLIGHT_LIST
layout(std430) readonly buffer List { uint list[]; };
layout(std430) readonly buffer Header { ListHeader header; };
#endif

uvec2 entry;
#define TRAVERSAL_ROOT entry.x
#define BLOCK_ROOT(head) entry.y
#include "shaders/lib/traverse.glsl"

void main() {
    uint path = gl_GlobalInvocationID.x;
#if HALFLIGHT_LIST
    if (path >= header.count) return;
    path = list[path];
#endif
    vec4 origin = texelFetch(rays, int(2u * path));
    vec4 direction = texelFetch(rays, int(2u * path + 1u));
    Ray ray = Ray(origin.xyz, origin.w, direction.xyz, direction.w);
    entry = texelFetch(entries, int(path)).xy;
    if (entry.x == 0u) ray.t_max = -1.0;
#if HALFLIGHT_ANY_HIT
    occluded[path] = traverse(ray, 0u, true).triangle == kMiss ? kFree : kOccluded;
#else
    hits[path] = traverse(ray, 0u, false);
#endif
}
