// Reads the points that the paths of a group have found, and their light, as texels. The kernels that connect and
// gather read each point 16 times.
#include "shaders/lib/group_rows.glsl"
#include "shaders/lib/light_of_hit.glsl"
#include "shaders/lib/occlusion.glsl"
#include "shaders/lib/state_texels.glsl"
#include "shaders/lib/sun_light.glsl"
#include "shaders/shared/reuse_groups.h"

const bool kPending = HALFLIGHT_PENDING != 0;  // the light of the last samples has not been added yet

uniform samplerBuffer points;         // RGBA32F: a ReusePoint for each path
uniform usamplerBuffer occluded;      // R32UI: answers to shadow rays
uniform usamplerBuffer sun_occluded;  // R32UI: answers to sun rays
uniform samplerBuffer sun_light;      // RGBA32F: radiance of sun samples
uniform samplerBuffer group_light;    // RGBA32F: kGroupRows rows for each path

vec4 point_texel(uint path, int texel) {
    return texelFetch(points, int(path) * (kReusePointTexels + HALFLIGHT_LAYER_ROWS) + texel);
}

// Returns the point of a path that has one, without its light.
ReusePoint load_point(uint path) {
    vec4 position = point_texel(path, 0);
    vec4 geometric = point_texel(path, 1);
    vec4 direction = point_texel(path, 2);
    ReusePoint y;
    y.position = position.xyz;
    y.offset = position.w;
    y.geometric_normal = geometric.xyz;
    y.distance = geometric.w;
    y.direction = direction.xyz;
    y.share = direction.w;
    for (int i = 0; i < HALFLIGHT_LAYER_ROWS; ++i) y.layers[i] = point_texel(path, kReusePointTexels + i);
    return y;
}

const uint kAllLight = 0u;

// Returns the complete ReusePoint::light; 0 if the path has no such vertex. part: kAllLight, or 1 + a light group,
// which gives its part of the light.
vec3 given_light(uint path, uint part) {
    PathState state = load_state(path);
    bool gives = state.lobe != kLobeNone && (state.reuse & kReusePoint) != 0u;
    vec3 light = gives ? point_texel(path, 3).xyz : vec3(0.0);
    bool has_sample = true, has_sun = true;
    if (kLightGroups > 0u && part != kAllLight) {
        int rows = int(path * kGroupRows);
        light = gives ? texelFetch(group_light, rows + int(kGivenGroups + part - 1u)).rgb : vec3(0.0);
        has_sample = word_of_float(texelFetch(group_light, rows).y) == part - 1u;
        if (kSun) has_sun = sun_group() == part - 1u;
    }
    bool answers = kPending && gives && state.pending_light != 0u;
    if (answers && has_sample) light += answered_light(point_texel(path, 4).xyz, texelFetch(occluded, int(path)).x);
    if (kSun && answers && has_sun)
        light += answered_light(texelFetch(sun_light, int(given_sun_light(path))).rgb,
                                texelFetch(sun_occluded, int(path)).x);
    return light;
}
