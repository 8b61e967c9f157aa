// Searches of rays through their tiles' lists. Binds the batch and its answers, and the list of rays for the second
// kernel.
#include "shaders/shared/ray_structs.h"
#include "shaders/shared/tile_list.h"
#include "shaders/trace_scene.glsl"
#include "shaders/lib/batch_answers.glsl"
#include "shaders/lib/tile_list.glsl"
#include "shaders/lib/tile_rays.glsl"
#define HALFLIGHT_STACK_MORE ((1 + HALFLIGHT_TWO_LEVEL) * kTileEntries)
#include "shaders/lib/traverse.glsl"

layout(std430) buffer Head { RestHeader rest_head; };
layout(std430) buffer Rest { RestEntry rest[]; };

// Result of a ray's test against the box of an entry.
struct EntryHit {
    int near;  // entry of the ray, bits of a float >= 0
    bool met;
};

EntryHit intersect_entry(BoxRay box, vec3 lower, vec3 upper, float t_min, float t_exit) {
    vec3 enter = mix(lower, upper, box.backward);
    vec3 leave = mix(upper, lower, box.backward);
    BoxHits h = intersect_boxes(box, vec4(enter.x), vec4(enter.y), vec4(enter.z), vec4(leave.x), vec4(leave.y),
                                vec4(leave.z), t_min, t_exit);
    return EntryHit(h.near.x, h.met.x);
}
