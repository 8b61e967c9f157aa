// Packs what patches are compared by. rg: luminance of the halves; b: their variance, smoothed; a: share of the first
// half, 0 where there is nothing to filter.
layout(local_size_x = 8, local_size_y = 8) in;

uniform sampler2D first;
uniform sampler2D second;
uniform sampler2D noise;  // r: weighted sum of half the squared difference; a: sum of the weights
// HALFLIGHT_UNSEEN:
uniform sampler2D surroundings;  // rgb: smoothed picture
uniform sampler2D albedo;
layout(rgba32f) writeonly uniform image2D light;

#include "shaders/lib/halves.glsl"

// Values that differ by less are equal: absolute, and as a share of the mean, both squared.
const float kLeastVariance = 1e-6;
const float kLeastRelativeVariance = 1e-5;
// HALFLIGHT_UNSEEN: standard deviation that is not filtered, over the light of the picture. Wide filters bend the light
// of corners by about the noise that they remove, which does not pay where the noise is hardly seen.
const float kUnseen = 0.07;

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(light)))) return;
    vec4 one = texelFetch(first, pixel, 0);
    vec4 two = texelFetch(second, pixel, 0);
    vec4 sums = texelFetch(noise, pixel, 0);
    float mean = squarable_luminance(mean_of(one, two));
    float noise_here = sums.r / max(sums.a, kLeastReach);
    if (HALFLIGHT_UNSEEN != 0) {
        float unseen = kUnseen * squarable_luminance(texelFetch(surroundings, pixel, 0).rgb /
                                                     luminance_of(texelFetch(albedo, pixel, 0).rgb));
        noise_here = max(noise_here - unseen * unseen, 0.0);
    }
    float variance = noise_here + kLeastVariance + kLeastRelativeVariance * mean * mean;
    imageStore(light, pixel, vec4(squarable_luminance(one.rgb), squarable_luminance(two.rgb), variance, one.a));
}
