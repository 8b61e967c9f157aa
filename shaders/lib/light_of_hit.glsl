// The light that a ray has hit, and light groups (Scene::light_groups), of which HALFLIGHT_LIGHT_GROUPS is the number.
// Needs shaders/geometry_tables.glsl and shaders/scene_tables.glsl.
#include "shaders/shared/light.h"
#include "shaders/shared/ray_structs.h"

#if HALFLIGHT_AREA_LIGHTS
// Returns the rank of a triangle among the lights of its block, or kNoLight.
uint light_rank(uint triangle) {
#if HALFLIGHT_SORTED_EMITTERS
    int count = textureSize(light_of_triangle), rank = 0;  // ranks below `rank` are of lower triangles
    for (int step = 1 << findMSB(max(count, 1)); step > 0; step >>= 1) {
        bool lower = rank + step <= count && texelFetch(light_of_triangle, rank + step - 1).x < triangle;
        rank += lower ? step : 0;
    }
    return rank < count && texelFetch(light_of_triangle, rank).x == triangle ? uint(rank) : kNoLight;
#else
    return texelFetch(light_of_triangle, int(triangle)).x;
#endif
}

// Returns the light that was hit, or kNoLight.
uint light_of_hit(Hit hit) {
    uint rank = light_rank(hit.triangle);
    if (rank == kNoLight) return kNoLight;
    uint first = 0u;
#if HALFLIGHT_INSTANCES
    first = texelFetch(light_of_triangle, textureSize(scene_triangles) + int(hit.instance)).x;
#endif
    return first + rank;
}
#endif

#if HALFLIGHT_LIGHT_GROUPS
uint light_group_entry(int entry) { return min(texelFetch(light_groups, entry).x, HALFLIGHT_LIGHT_GROUPS - 1u); }
uint group_of_light(uint light) { return light_group_entry(2 + int(light)); }
// Returns the group of the sun that is sampled apart. It has the last row.
uint sun_group() { return group_of_light(uint(textureSize(scene_lights) / kLightStride) - 1u); }

// Returns the group of the light that a ray meets. is_hit: it meets a surface, else the environment.
uint group_of_met(Hit hit, bool is_hit) {
    uint light = kNoLight;
#if HALFLIGHT_AREA_LIGHTS
    light = light_of_hit(hit);
#endif
    return !is_hit ? light_group_entry(0) : light == kNoLight ? light_group_entry(1) : group_of_light(light);
}
#endif
