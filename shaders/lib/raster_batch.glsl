// The traced batch: the path of an entry, its ray, and its hit so far.
//
// Variant: HALFLIGHT_LIST, HALFLIGHT_ANY_HIT.
#include "shaders/lib/batch_rays.glsl"
#include "shaders/lib/finite.glsl"

#if HALFLIGHT_ANY_HIT
layout(std430) buffer Occluded { uint occluded[]; };
#else
layout(std430) buffer Hits { Hit hits[]; };
#endif
#if HALFLIGHT_LIST
layout(std430) readonly buffer List { uint list[]; };
layout(std430) readonly buffer Header { ListHeader header; };
uint entry_count() { return header.count; }
uint path_of(uint entry) { return list[entry]; }
#else
uniform uint capacity;
uint entry_count() { return capacity; }
uint path_of(uint entry) { return entry; }
#endif
