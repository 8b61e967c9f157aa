// Runs before anything is traced, one texel per tile. It stores the shaft of the rays, the set of live rays, and the
// reach of the farthest ray (as depth). It also sets all answers to misses.
//
// HALFLIGHT_ENDS: rays end where the buffer Ends says, at the latest.
#include "shaders/trace_scene.glsl"
#include "shaders/lib/batch_answers.glsl"
#include "shaders/lib/batch_paths.glsl"
#include "shaders/lib/batch_rays.glsl"
#include "shaders/lib/bvh.glsl"
#include "shaders/lib/raster_shaft.glsl"
#include "shaders/lib/raster_end.glsl"
#include "shaders/lib/raster_texels.glsl"

layout(std430) writeonly buffer Shafts { vec4 shafts[]; };
layout(std430) writeonly buffer Alive { uvec2 alive[]; };
OPTIONAL(HALFLIGHT_ENDS) layout(std430) readonly buffer Ends { float ends_of_rays[]; };

void main() {
    uint tile = tile_of_texel(uvec2(gl_FragCoord.xy));
    BvhHead head = bvh_head(0u);
    TimedShaft shaft = empty_shaft();
    float greatest_t = -1.0;
    uvec2 living = uvec2(0u);
    bool finite = true;
    uint first = tile * 64u;
    uint count = min(entry_count(), first + 64u);
    for (uint entry = first; entry < count; ++entry) {
        uint path = path_of(entry);
        Ray ray = load_ray(path);
        if (HALFLIGHT_ENDS != 0) ray.t_max = min(ray.t_max, ends_of_rays[path]);
        store_answer(path, Hit(intBitsToFloat(kBvhFar), 0.0, 0.0, kMiss, kMiss));
        float end = ray.t_max >= ray.t_min ? end_of(ray, head) : -1.0;
        if (end >= 0.0) {
            vec3 to = ray.origin + end * ray.direction;
            shaft = shaft_union(shaft, TimedShaft(Shaft(ray.origin, ray.origin, to, to), end));
            greatest_t = max(greatest_t, end);
            finite = finite && all(lessThan(abs(ray.origin), vec3(kShaftBig))) && all(lessThan(abs(to), vec3(kShaftBig)));
            living[(entry >> 5) & 1u] |= 1u << (entry & 31u);
        }
    }
    if (!finite) shaft = endless_shaft();
    shafts[4u * tile] = vec4(shaft.rays.origin_lower, shaft.least_t);
    shafts[4u * tile + 1u] = vec4(shaft.rays.origin_upper, greatest_t);
    shafts[4u * tile + 2u] = vec4(shaft.rays.end_lower, 0.0);
    shafts[4u * tile + 3u] = vec4(shaft.rays.end_upper, 0.0);
    alive[tile] = living;
    gl_FragDepth = greatest_t < 0.0 ? kDeadDepth : depth_of(greatest_t);
}
