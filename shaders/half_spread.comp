// Spreads the light of fireflies over the pixels around them, the receivers. The light is divided by the sum of the
// receivers' weights, so that none is lost.
//
// HALFLIGHT_RECEIVERS computes the weights, HALFLIGHT_EXCESS divides the light. Otherwise, sums of the quotients become
// light over albedo. HALFLIGHT_LEVEL: receivers are weighed by the light that they have, so that dark surfaces beside a
// highlight stay dark. Else they receive alike.
layout(local_size_x = 8, local_size_y = 8) in;

#include "shaders/lib/halves.glsl"

// Inputs with HALFLIGHT_RECEIVERS or HALFLIGHT_EXCESS:
uniform sampler2D removed;      // rgb: light of fireflies over albedo; a: 0 where there is nothing to filter
uniform sampler2D albedo;
// Input with HALFLIGHT_LEVEL:
uniform sampler2D levels;       // shaders/half_fireflies.comp writes them
uniform sampler2D few_levels;   // weighted sum of `levels` over kNoiseRadius
uniform sampler2D more_levels;  // weighted sum of `levels` over kAroundRadius
uniform sampler2D around;       // rgb: weighted sum of light over albedo with fireflies; a: sum of the weights
// Input with HALFLIGHT_EXCESS:
uniform sampler2D reach;        // rgb: weighted sum of the receivers
// Inputs of the other variants:
uniform sampler2D receivers;    // rgb: weight of a pixel; a: the part of it that is not its albedo
uniform sampler2D quotients;    // rgb: weighted sum of light of fireflies over `reach`

layout(rgba32f) writeonly uniform image2D made;

// Share of the level over more pixels, which bridges those in which few samples meet light.
const float kShareOfMore = 0.02;
// Share of the light with fireflies, where there is no other light.
const float kLastShare = 1e-6;

// Returns the level of the darker half.
float darker(vec4 sums) { return min(sums.r, sums.g) / max(sums.a, kLeastReach); }

// Returns how much a pixel receives for its albedo.
float level_at(ivec2 pixel) {
    if (HALFLIGHT_LEVEL == 0) return 1.0;
    vec4 all = texelFetch(around, pixel, 0);
    // Fireflies, and highlights that count as such, are no level for others. Highlights are bright in both halves, and
    // get their light back.
    vec4 own = texelFetch(levels, pixel, 0);
    return (own.a > 0.0 ? darker(texelFetch(few_levels, pixel, 0)) : own.b) +
           kShareOfMore * darker(texelFetch(more_levels, pixel, 0)) +
           kLastShare * squarable_luminance(all.rgb / max(all.a, kLeastReach));
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(made)))) return;
    if (HALFLIGHT_RECEIVERS != 0) {
        float level = level_at(pixel);
        bool receives = texelFetch(removed, pixel, 0).a > 0.0;
        imageStore(made, pixel, receives ? vec4(level * texelFetch(albedo, pixel, 0).rgb, level) : vec4(0.0));
    } else if (HALFLIGHT_EXCESS != 0) {
        vec3 light = texelFetch(removed, pixel, 0).rgb * texelFetch(albedo, pixel, 0).rgb;
        imageStore(made, pixel, vec4(light / max(texelFetch(reach, pixel, 0).rgb, vec3(kLeastLight)), 0.0));
    } else {
        imageStore(made, pixel, vec4(texelFetch(receivers, pixel, 0).a * texelFetch(quotients, pixel, 0).rgb, 0.0));
    }
}
