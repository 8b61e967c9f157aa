// Gives light back that non-local means have lost.
//
// Highlights of small lights, sharp or blurred by a lens, are regions in which few samples meet the light. Features are
// alike there, so they cannot tell bright pixels from dark ones. Bright pixels then have more noise than dark ones.
// They take light from dark pixels, which take less from them (kBrighter of shaders/nl_means.comp), and the highlight
// becomes darker. Here each pixel's loss is shared by the filtered light around it, in proportion: light that is dark
// stays dark. Light that the filter does not change stays as it is.
//
// Filtered light also differs from its neighbourhood's by the noise that the filter has removed, which must not return:
// it would be seen as blotches of the neighbourhood's size. A loss is given back as far as it is larger than what losses
// of single pixels add up to by chance.
//
// HALFLIGHT_LIGHT computes the luminance of filtered light, HALFLIGHT_LOST the share of light that was lost in
// a neighbourhood. Otherwise, filtered light is scaled.
layout(local_size_x = 8, local_size_y = 8) in;

#include "shaders/lib/halves.glsl"

const bool kLight = HALFLIGHT_LIGHT != 0;
const bool kLost = HALFLIGHT_LOST != 0;

uniform sampler2D first;  // filtered halves; kLost: before the filter
uniform sampler2D second;
uniform sampler2D albedo;
uniform sampler2D light;       // kLost: rg: luminance of the filtered halves
uniform sampler2D around;      // kLost: rg: weighted sum of `light`
uniform sampler2D gains;       // weighted sum of what kLost writes
uniform sampler2D more_gains;  // weighted sum over more pixels
// kLight: rg: luminance of the halves; kLost: r: share of light lost, g: its square, b: its fourth power, a: 1; else
// scaled halves
layout(rgba32f) writeonly uniform image2D made;
layout(rgba32f) writeonly uniform image2D made_second;

uniform float pooled_squares;  // sum of the squares of the weights of `gains`
uniform float by_chance;       // weight of tails in what counts as noise

const float kMostLoss = 1e8;    // larger values count as this one, so that sums of fourth powers are finite
const float kLeastLoss = 1e-3;  // share of the light; smaller losses are rounding, and stay

// Returns the luminance of the halves at a pixel.
vec2 luminance_at(ivec2 pixel) {
    vec3 reflected = texelFetch(albedo, pixel, 0).rgb;
    vec4 one = texelFetch(first, pixel, 0);
    vec3 two = texelFetch(second, pixel, 0).rgb;
    vec2 own = vec2(squarable_luminance(reflected * one.rgb), squarable_luminance(reflected * two));
    return one.a > 0.0 ? own : vec2(0.0);
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, textureSize(first, 0)))) return;
    if (kLost) {
        float share = texelFetch(first, pixel, 0).a;
        vec2 own = luminance_at(pixel) - texelFetch(light, pixel, 0).rg;
        vec2 all = texelFetch(around, pixel, 0).rg;
        float lost = mix(own.g, own.r, share) / max(mix(all.g, all.r, share), kLeastLight);
        lost = clamp(lost, -kMostLoss, kMostLoss);
        imageStore(made, pixel, vec4(lost, lost * lost, lost * lost * lost * lost, 1.0));
    } else if (kLight) {
        imageStore(made, pixel, vec4(luminance_at(pixel), 0.0, 0.0));
    } else {
        vec2 gain = texelFetch(gains, pixel, 0).rg;
        // If few samples meet light, none of them may lie in a neighbourhood. Its pixels then agree, but show nothing.
        vec4 more = texelFetch(more_gains, pixel, 0);
        float squares = gain.x > 0.0 ? gain.y : max(gain.y, more.g);
        // The variance of few values with long tails is underestimated, by its own standard error.
        float tails = max(more.b * more.a / max(more.g * more.g, 1e-30) - 3.0, 0.0);
        float noise = (1.0 + by_chance * sqrt(tails * pooled_squares)) * pooled_squares * squares;
        float lost = max(gain.x * gain.x - noise, 0.0) / max(abs(gain.x), kLeastReach);
        float scale = max(1.0 + sign(gain.x) * max(lost - kLeastLoss, 0.0), 0.0);
        vec4 one = texelFetch(first, pixel, 0);
        vec4 two = texelFetch(second, pixel, 0);
        imageStore(made, pixel, vec4(scale * one.rgb, one.a));
        imageStore(made_second, pixel, vec4(scale * two.rgb, two.a));
    }
}
