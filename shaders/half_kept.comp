// Gives light back that non-local means have lost.
//
// Highlights of small lights, sharp or blurred by a lens, are regions in which few samples meet the light. Features are
// alike there, so they cannot tell bright pixels from dark ones. Bright pixels then have more noise than dark ones.
// They take light from dark pixels, which take less from them (kBrighter of shaders/nl_means.comp), and the highlight
// becomes darker. Here each pixel's loss is shared by the filtered light around it, in proportion: light that is dark
// stays dark. Only what both halves have lost is given back. Light that the filter does not change stays as it is.
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
uniform sampler2D light;   // kLost: rg: luminance of the filtered halves
uniform sampler2D around;  // kLost: rg: weighted sum of `light`
uniform sampler2D gains;   // rg: weighted sum of the share of light lost
// kLight: rg: luminance of the halves; kLost: rg: share of light lost, by half; else scaled halves
layout(rgba32f) writeonly uniform image2D made;
layout(rgba32f) writeonly uniform image2D made_second;

const float kLeastLoss = 1e-3;  // share of the light; smaller losses are rounding, and stay

// Returns the luminance of the halves at a pixel.
vec2 luminance_at(ivec2 pixel) {
    vec3 reflected = texelFetch(albedo, pixel, 0).rgb;
    vec4 one = texelFetch(first, pixel, 0);
    vec3 two = texelFetch(second, pixel, 0).rgb;
    return one.a > 0.0 ? vec2(squarable_luminance(reflected * one.rgb), squarable_luminance(reflected * two)) : vec2(0.0);
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, textureSize(first, 0)))) return;
    if (kLost) {
        vec2 own = luminance_at(pixel) - texelFetch(light, pixel, 0).rg;
        imageStore(made, pixel, vec4(own / max(texelFetch(around, pixel, 0).rg, vec2(kLeastLight)), 0.0, 0.0));
    } else if (kLight) {
        imageStore(made, pixel, vec4(luminance_at(pixel), 0.0, 0.0));
    } else {
        // Only what both halves have lost is given back: their noise is independent.
        vec2 gain = texelFetch(gains, pixel, 0).rg;
        float lost_by_both = gain.x * gain.y > 0.0 ? max(min(abs(gain.x), abs(gain.y)) - kLeastLoss, 0.0) : 0.0;
        float scale = max(1.0 + sign(gain.x) * lost_by_both, 0.0);
        vec4 one = texelFetch(first, pixel, 0);
        vec4 two = texelFetch(second, pixel, 0);
        imageStore(made, pixel, vec4(scale * one.rgb, one.a));
        imageStore(made_second, pixel, vec4(scale * two.rgb, two.a));
    }
}
