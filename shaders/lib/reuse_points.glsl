// Points that the paths of a group have found, for the kernels that connect and gather. They are bound as texels,
// because each is read 16 times, and texels are faster. Include after the blocks `states[]` and, with
// HALFLIGHT_PENDING, `occluded[]`, `sun_occluded[]` and `sun_light[]` (HALFLIGHT_SUN).
#include "shaders/lib/occlusion.glsl"
#include "shaders/lib/sun_light.glsl"
#include "shaders/shared/path.h"
#include "shaders/shared/reuse.h"

uniform samplerBuffer points;  // RGBA32F, kReusePointTexels for each path

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
    bool gives = states[path].lobe != kLobeNone && (states[path].reuse & kReusePoint) != 0u;
    vec3 light = gives ? point_texel(path, 4).xyz : vec3(0.0);
#ifdef HALFLIGHT_PENDING
    bool answers = gives && states[path].pending_light != 0u;
    if (answers) light += answered_light(point_texel(path, 5).xyz, occluded[path]);
#ifdef HALFLIGHT_SUN
    if (answers) light += answered_light(sun_light[given_sun_light(path)].rgb, sun_occluded[path]);
#endif
#endif
    return light;
}
