// Removes the light of fireflies from two halves.
layout(local_size_x = 8, local_size_y = 8) in;

uniform sampler2D first;
uniform sampler2D second;
uniform sampler2D outliers;  // rg: share of the excess in the light of the halves
uniform sampler2D pooled;    // ba: terms of the best share of the excess to remove, averaged
layout(rgba32f) writeonly uniform image2D calm_first;
layout(rgba32f) writeonly uniform image2D calm_second;
layout(rgba32f) writeonly uniform image2D removed;  // rgb: light removed from the mean; a: 0 where there is nothing to filter
// rg: luminance of the calm halves, a: 1; outliers and pixels where there is nothing to filter have 0; b: luminance of
// the darker half
layout(rgba32f) writeonly uniform image2D levels;

#include "shaders/lib/halves.glsl"

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(removed)))) return;
    vec4 one = texelFetch(first, pixel, 0);
    vec4 two = texelFetch(second, pixel, 0);
    vec4 found = texelFetch(outliers, pixel, 0);
    vec2 share = found.rg * best_share(texelFetch(pooled, pixel, 0).ba);
    vec3 calm_one = one.rgb - share.x * one.rgb;
    vec3 calm_two = two.rgb - share.y * two.rgb;
    bool filled = one.a > 0.0;
    vec3 light = mix(share.y * two.rgb, share.x * one.rgb, one.a);
    vec2 luminances = vec2(squarable_luminance(calm_one), squarable_luminance(calm_two));
    imageStore(calm_first, pixel, vec4(calm_one, one.a));
    imageStore(calm_second, pixel, vec4(calm_two, two.a));
    imageStore(removed, pixel, filled ? vec4(light, 1.0) : vec4(0.0));
    vec4 level = vec4(luminances, min(luminances.x, luminances.y), 1.0);
    if (any(greaterThan(found.rg, vec2(0.0)))) level.rga = vec3(0.0);
    imageStore(levels, pixel, filled ? level : vec4(0.0));
}
