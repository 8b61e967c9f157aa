// Finds outliers of two halves: light far above the mean around it. Computes the terms that tell fireflies, which one
// half has, from highlights, which both have.
layout(local_size_x = 8, local_size_y = 8) in;

uniform sampler2D first;
uniform sampler2D second;
uniform sampler2D around;  // rgb: weighted sum of the mean of the halves; a: sum of the weights
layout(rgba32f) writeonly uniform image2D outliers;  // rg: share of the excess in the light of the halves; ba: terms

#include "shaders/lib/halves.glsl"

// An outlier's luminance over that of the mean around it.
const float kMostOfMean = HALFLIGHT_PREVIEW != 0 ? 5.0 : 10.0;

// Returns the share of a value that exceeds `most`.
float excess(vec3 value, float most) {
    float own = luminance_of(value);
    return own > most ? 1.0 - most / own : 0.0;
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(outliers)))) return;
    vec4 one = texelFetch(first, pixel, 0);
    vec4 two = texelFetch(second, pixel, 0);
    vec4 sums = texelFetch(around, pixel, 0);
    float most = kMostOfMean * luminance_of(sums.rgb / max(sums.a, kLeastReach));
    vec2 shares = vec2(excess(one.rgb, most), excess(two.rgb, most));
    vec3 mean = mean_of(one, two);
    vec2 terms = change_terms(-shares.x * one.rgb, -shares.y * two.rgb, two.rgb - one.rgb, one.a,
                              1.0 / max(luminance_of(mean), kLeastLight));
    imageStore(outliers, pixel, one.a > 0.0 ? vec4(shares, terms) : vec4(0.0));
}
