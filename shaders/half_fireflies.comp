// Removes the excess of fireflies from two halves. The excess is divided by the sum of the weights with which it will be
// spread, so that no light is lost.
layout(local_size_x = 8, local_size_y = 8) in;

uniform sampler2D first;
uniform sampler2D second;
uniform sampler2D outliers;  // rg: share of the excess in the light of the halves
uniform sampler2D pooled;    // ba: terms of the best share of the excess to remove, averaged
uniform sampler2D albedo;
uniform sampler2D reach;  // rgb: weighted sum of the albedo of the pixels over which the excess is spread
layout(rgba32f) writeonly uniform image2D calm_first;
layout(rgba32f) writeonly uniform image2D calm_second;
layout(rgba32f) writeonly uniform image2D excess;

#include "shaders/lib/halves.glsl"

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(excess)))) return;
    vec4 one = texelFetch(first, pixel, 0);
    vec4 two = texelFetch(second, pixel, 0);
    vec2 removed = texelFetch(outliers, pixel, 0).rg * best_share(texelFetch(pooled, pixel, 0).ba);
    vec3 rest = mix(removed.y * two.rgb, removed.x * one.rgb, one.a);
    vec3 shared_by = max(texelFetch(reach, pixel, 0).rgb, vec3(kLeastReach));
    imageStore(calm_first, pixel, vec4(one.rgb - removed.x * one.rgb, one.a));
    imageStore(calm_second, pixel, vec4(two.rgb - removed.y * two.rgb, two.a));
    imageStore(excess, pixel,
               one.a > 0.0 ? vec4(rest * (texelFetch(albedo, pixel, 0).rgb / shared_by), 1.0) : vec4(0.0));
}
