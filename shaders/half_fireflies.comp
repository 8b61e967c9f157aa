// Removes the excess of fireflies from two halves.
layout(local_size_x = 8, local_size_y = 8) in;

uniform sampler2D first;
uniform sampler2D second;
uniform sampler2D outliers;  // rg: share of the excess in the light of the halves
uniform sampler2D pooled;    // ba: terms of the best share of the excess to remove, averaged
layout(rgba32f) writeonly uniform image2D calm_first;
layout(rgba32f) writeonly uniform image2D calm_second;
layout(rgba32f) writeonly uniform image2D removed;  // rgb: excess in the mean; a: 0 where there is nothing to filter

#include "shaders/lib/halves.glsl"

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(removed)))) return;
    vec4 one = texelFetch(first, pixel, 0);
    vec4 two = texelFetch(second, pixel, 0);
    vec2 share = texelFetch(outliers, pixel, 0).rg * best_share(texelFetch(pooled, pixel, 0).ba);
    vec3 excess_one = share.x * one.rgb;
    vec3 excess_two = share.y * two.rgb;
    imageStore(calm_first, pixel, vec4(one.rgb - excess_one, one.a));
    imageStore(calm_second, pixel, vec4(two.rgb - excess_two, two.a));
    imageStore(removed, pixel, one.a > 0.0 ? vec4(mix(excess_two, excess_one, one.a), 1.0) : vec4(0.0));
}
