// Lists the rays of a batch that meet one of the root's boxes of the hierarchies over panes alone. Software drivers run
// the whole kernel of shaders/panes.comp for rays that meet nothing.
#include "shaders/trace_scene.glsl"
#include "shaders/lib/bvh.glsl"
#include "shaders/lib/hit_texels.glsl"
#include "shaders/lib/ray_texels.glsl"

layout(local_size_x = 64) in;

const bool kListed = HALFLIGHT_LIST != 0;         // the rays of the listed paths
const bool kScattered = HALFLIGHT_SCATTERED != 0;  // they end at their hits; otherwise, shadow rays that are free

OPTIONAL(HALFLIGHT_LIST) layout(std430) readonly buffer List { uint list[]; };
OPTIONAL(HALFLIGHT_LIST) layout(std430) readonly buffer Header { ListHeader header; };
layout(std430) writeonly buffer Selected { uint selected[]; };
layout(std430) buffer SelectedHeader { ListHeader selected_header; };
uniform usamplerBuffer occluded;  // R32UI: answers to the rays

void main() {
    uint path = gl_GlobalInvocationID.x;
    bool asks = !kListed || path < header.count;
    if (kListed) path = list[asks ? path : 0u];
    Ray ray = load_ray(path);
    if (kScattered) ray.t_max = min(ray.t_max, load_hit(path).t);
    else asks = asks && texelFetch(occluded, int(path)).x == kFree;
    BvhHead head = bvh_head(0u);
    BvhStep root = bvh_step(box_ray(ray.origin, ray.direction, head.base, head.cell, head.slack), kBvhTag | 1u, ray.t_min,
                            ray.t_max);
    if (!asks || ray.t_max < ray.t_min || root.near.x == kBvhFar) return;
    uint place = atomicAdd(selected_header.count, 1u);
    if ((place & 63u) == 0u) atomicAdd(selected_header.groups_x, 1u);
    selected[place] = path;
}
