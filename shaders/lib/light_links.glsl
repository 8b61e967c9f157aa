// Light links (shaders/shared/light_links.h). Needs shaders/geometry_tables.glsl and shaders/scene_tables.glsl.
#include "shaders/shared/light_links.h"
#include "shaders/shared/ray_structs.h"

const bool kLightLinks = HALFLIGHT_LIGHT_LINKS != 0;    // some light leaves out objects, as receivers or blockers
const bool kShadowLinks = HALFLIGHT_SHADOW_LINKS != 0;  // light of some light passes objects

uint class_entry(int object) {
    int texel = int(texelFetch(light_links, 0).x) + object / int(kClassesPerTexel);
    uint byte = uint(object) % kClassesPerTexel;
    return (texelFetch(light_links, texel)[byte / 4u] >> (8u * (byte % 4u))) & 0xffu;
}

// Returns the class of the object of a triangle; 0 without links.
uint class_of_object(uint triangle, uint instance) {
    if (!kLightLinks) return 0u;
    uint own = class_entry(int(triangle));
    return kInstances ? max(own, class_entry(textureSize(scene_triangles) + int(instance))) : own;
}

bool has_class(uvec2 classes, uint link_class) {
    return (((link_class < 32u ? classes.x : classes.y) >> (link_class & 31u)) & 1u) != 0u;
}

// Returns whether lights of a set light objects of a class.
bool lights_class(uint set, uint link_class) { return has_class(texelFetch(light_links, 1 + int(set)).xy, link_class); }

// Returns whether objects of a class cast shadows of lights of a set.
bool blocks_light(uint set, uint link_class) { return has_class(texelFetch(light_links, 1 + int(set)).zw, link_class); }

// Returns whether light samples alone find the lights of a set. Scattered rays end at the objects that this light passes.
bool sampled_alone(uint set) {
    return kShadowLinks && texelFetch(light_links, 1 + int(set)).zw != uvec2(0xffffffffu);
}

// Shadow rays have the set of their light in t_min, as a number so small that no hit lies before it: an odd number of
// units above kMarkedStart, or an even one if the ray is marked.
float start_of_shadow_ray(float t_min, uint set) {
    if (!kShadowLinks || set == 0u) return t_min;
    return uintBitsToFloat(floatBitsToUint(kMarkedStart) + 2u * set + (t_min > 0.0 ? 0u : 1u));
}
bool is_marked_start(float t_min) {
    return t_min > 0.0 && (!kShadowLinks || ((floatBitsToUint(t_min) - floatBitsToUint(kMarkedStart)) & 1u) == 0u);
}
// Returns the set of the light of a shadow ray; 0 for rays that start farther away, which are no shadow rays.
uint set_of_shadow_ray(float t_min) {
    return t_min > 0.0 && t_min < 1e-30 ? (floatBitsToUint(t_min) - floatBitsToUint(kMarkedStart)) >> 1 : 0u;
}
