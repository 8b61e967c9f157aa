// The batch that is traced: which path an entry is, its ray, and what is known of its hit.
//
// Variant: HALFLIGHT_LIST, HALFLIGHT_ANY_HIT.
#include "shaders/shared/rays.h"
#include "shaders/lib/finite.glsl"

layout(binding = UNIT_FREE) uniform samplerBuffer rays;  // RGBA32F, two texels each
#ifdef HALFLIGHT_ANY_HIT
layout(std430, binding = 0) buffer Occluded { uint occluded[]; };
#else
layout(std430, binding = 0) buffer Hits { Hit hits[]; };
#endif
#ifdef HALFLIGHT_LIST
layout(std430, binding = 1) readonly buffer List { uint list[]; };
layout(std430, binding = 2) readonly buffer Header { ListHeader header; };
uint entry_count() { return header.count; }
uint path_of(uint entry) { return list[entry]; }
#else
uniform uint capacity;
uint entry_count() { return capacity; }
uint path_of(uint entry) { return entry; }
#endif

Ray load_ray(uint path) {
    vec4 origin = texelFetch(rays, int(2u * path));
    vec4 direction = texelFetch(rays, int(2u * path + 1u));
    return Ray(origin.xyz, origin.w, direction.xyz, direction.w);
}
