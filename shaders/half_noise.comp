// Computes what patches are compared by: the luminance of two halves, and its variance.
//
// Outliers that only one half has are limited. A single one would make a patch unlike all others, and the pixels around
// it would keep their noise. The light that is averaged is not limited.
layout(local_size_x = 8, local_size_y = 8) in;

uniform sampler2D first;
uniform sampler2D second;
// rg: weighted sum of the luminance of the halves without fireflies, a: sum of the weights
uniform sampler2D around;
// rg: luminance of the halves, limited; b: half the squared difference, which is the variance of a half if both have as
// many samples; a: 1 where there is light to filter, else 0
layout(rgba32f) writeonly uniform image2D noise;

#include "shaders/lib/halves.glsl"

// Limits of a half's luminance: over the mean around, and over the largest value that the other half has beside it.
const float kMostOfMean = 3.0;
const float kMostOfOther = 3.0;

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    ivec2 size = imageSize(noise);
    if (any(greaterThanEqual(pixel, size))) return;
    vec4 one = texelFetch(first, pixel, 0);
    vec2 own = vec2(squarable_luminance(one.rgb), squarable_luminance(texelFetch(second, pixel, 0).rgb));
    if (HALFLIGHT_LIMITED != 0) {
        vec2 beside = vec2(0.0);
        for (int i = 0; i < 9; ++i) {
            ivec2 other = clamp(pixel + ivec2(i % 3, i / 3) - 1, ivec2(0), size - 1);
            beside = max(beside, vec2(squarable_luminance(texelFetch(first, other, 0).rgb),
                                      squarable_luminance(texelFetch(second, other, 0).rgb)));
        }
        vec4 sums = texelFetch(around, pixel, 0);
        float most = kMostOfMean * 0.5 * (sums.r + sums.g) / max(sums.a, kLeastReach);
        own = min(own, max(vec2(most), kMostOfOther * beside.yx));
    }
    float apart = own.x - own.y;
    imageStore(noise, pixel, one.a > 0.0 ? vec4(own, 0.5 * apart * apart, 1.0) : vec4(0.0));
}
