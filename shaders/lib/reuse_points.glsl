// Reads the points that the paths of a group have found, and their light, as texels. The kernels that connect and gather
// read each point 16 times.
#include "shaders/lib/occlusion.glsl"
#include "shaders/lib/state_texels.glsl"
#include "shaders/lib/sun_light.glsl"
#include "shaders/shared/reuse.h"

uniform samplerBuffer points;  // RGBA32F, kReusePointTexels for each path
#ifdef HALFLIGHT_PENDING
uniform usamplerBuffer occluded;  // R32UI: answers to shadow rays
#ifdef HALFLIGHT_SUN
uniform usamplerBuffer sun_occluded;  // R32UI: answers to sun rays
uniform samplerBuffer sun_light;      // RGBA32F: radiance of sun samples
#endif
#endif

vec4 point_texel(uint path, int texel) { return texelFetch(points, int(path) * kReusePointTexels + texel); }

// Returns the point of a path that has one, without its light.
ReusePoint load_point(uint path) {
    vec4 position = point_texel(path, 0);
    vec4 geometric = point_texel(path, 1);
    vec4 direction = point_texel(path, 2);
    vec4 shading = point_texel(path, 3);
    ReusePoint y;
    y.position = position.xyz;
    y.offset = position.w;
    y.geometric_normal = geometric.xyz;
    y.distance = geometric.w;
    y.direction = direction.xyz;
    y.share = direction.w;
    y.normal = shading.xyz;
    y.alpha = shading.w;
#ifdef HALFLIGHT_GLOSSY
    y.f0 = point_texel(path, 4).w;
    y.f90 = point_texel(path, 5).w;
#endif
#ifdef HALFLIGHT_CLEARCOAT
    vec4 coat = point_texel(path, 6);
    y.coat_normal = coat.xyz;
    y.coat_alpha = coat.w;
    y.coat = point_texel(path, 7).x;
#endif
    return y;
}

// Returns the complete ReusePoint::light; 0 where the path has no such vertex.
vec3 given_light(uint path) {
    PathState state = load_state(path);
    bool gives = state.lobe != kLobeNone && (state.reuse & kReusePoint) != 0u;
    vec3 light = gives ? point_texel(path, 4).xyz : vec3(0.0);
#ifdef HALFLIGHT_PENDING
    bool answers = gives && state.pending_light != 0u;
    if (answers) light += answered_light(point_texel(path, 5).xyz, texelFetch(occluded, int(path)).x);
#ifdef HALFLIGHT_SUN
    if (answers)
        light += answered_light(texelFetch(sun_light, int(given_sun_light(path))).rgb,
                                texelFetch(sun_occluded, int(path)).x);
#endif
#endif
    return light;
}
