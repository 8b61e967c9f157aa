// Search of a ray below the nodes of a tile's list. Needs shaders/trace_scene.glsl.
//
// The variants are those of shaders/lib/traverse.glsl.
#include "shaders/shared/raster_lists.h"
#define HALFLIGHT_STACK_MORE (4 * int(kRasterList))
#include "shaders/lib/traverse.glsl"

uniform usamplerBuffer lists;  // R32UI: kRasterList entries per tile

// Returns the hit of a ray below the nodes of the list, and `known`, as in traverse_from(). Near entries come first in
// the list and lie on top of the stack.
Hit search(Ray ray, uint first_entry, uint list_size, Hit known, Sampler random, const bool any_hit) {
    BvhHead head = bvh_head(0u);
    BoxRay box = box_ray(ray.origin, ray.direction, head.base, head.cell, head.slack);
    float t_exit = known.triangle != kMiss ? known.t : ray.t_max;
    if (!(ray.t_max >= ray.t_min)) list_size = 0u;
    int entries = 0;
    for (uint i = list_size; i > 0u; --i) {
        uint entry = texelFetch(lists, int(first_entry + i) - 1).x;
        uint node = entry & kBvhIndexMask;
        bvec4 slots = notEqual(uvec4(entry >> kRasterSlotShift) & uvec4(1u, 2u, 4u, 8u), uvec4(0u));
        put_aside(bvh_step(box, node, ray.t_min, t_exit, slots), 0, entries, any_hit);
    }
    return traverse_from(ray, entries, known, random, any_hit);
}
