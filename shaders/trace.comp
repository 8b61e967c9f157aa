// Hits of a batch of rays. HALFLIGHT_ANY_HIT: whether there is any; HALFLIGHT_LIST: of the listed paths only.
#include "shaders/shared/frame.h"
#include "shaders/shared/rays.h"
#include "shaders/trace_scene.glsl"
#include "shaders/lib/hash.glsl"
#include "shaders/lib/traverse.glsl"

layout(local_size_x = 64) in;

layout(binding = UNIT_FREE) uniform samplerBuffer rays;  // RGBA32F, two texels each
#ifdef HALFLIGHT_ANY_HIT
layout(std430, binding = 0) writeonly buffer Occluded { uint occluded[]; };
#else
layout(std430, binding = 0) writeonly buffer Hits { Hit hits[]; };
#endif
#ifdef HALFLIGHT_LIST
layout(std430, binding = 1) readonly buffer List { uint list[]; };
layout(std430, binding = 2) readonly buffer Header { ListHeader header; };
#endif
#ifdef HALFLIGHT_ALPHA
layout(std140, binding = BLOCK_FRAME) uniform FrameBlock { Frame frame; };
uniform uint alpha_salt;
#endif

Ray load_ray(uint path) {
    vec4 origin = texelFetch(rays, int(2u * path));
    vec4 direction = texelFetch(rays, int(2u * path + 1u));
    return Ray(origin.xyz, origin.w, direction.xyz, direction.w);
}

void main() {
    uint path = gl_GlobalInvocationID.x;
#ifdef HALFLIGHT_LIST
    if (path >= header.count) return;
    path = list[path];
#endif
#ifdef HALFLIGHT_ALPHA
    uint key = ray_key(path, hash_combine(hash_combine(frame.seed, frame.sample_index), alpha_salt));
#else
    uint key = 0u;
#endif
#ifdef HALFLIGHT_ANY_HIT
    Hit hit = traverse(load_ray(path), key, true);
    occluded[path] = hit.triangle == kMiss ? kFree : floatBitsToUint(hit.t) != floatBitsToUint(not_a_number()) ? kOccluded : kUnfinished;
#else
    hits[path] = traverse(load_ray(path), key, false);
#endif
}
