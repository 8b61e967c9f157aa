// Spreads the light of fireflies over the pixels around them, the receivers. It is divided by the sum of their weights, so
// that no light is lost.
//
// Variants: HALFLIGHT_RECEIVERS computes the weights, HALFLIGHT_EXCESS divides light by their sums. Otherwise, the sums of
// these quotients become light over albedo. HALFLIGHT_LEVEL: pixels receive in proportion to the light around them, so
// that surfaces which are dark beside a highlight stay dark. Else they receive alike.
layout(local_size_x = 8, local_size_y = 8) in;

#include "shaders/lib/halves.glsl"

uniform sampler2D removed;  // rgb: light of fireflies over albedo; a: 0 where there is nothing to filter
#if defined(HALFLIGHT_RECEIVERS) || defined(HALFLIGHT_EXCESS)
uniform sampler2D albedo;
#endif
#ifdef HALFLIGHT_EXCESS
uniform sampler2D reach;    // rgb: weighted sum of the receivers
#elif !defined(HALFLIGHT_RECEIVERS)
uniform sampler2D shares;   // rgb: weighted sum of light of fireflies over `reach`
#endif
#ifdef HALFLIGHT_LEVEL
uniform sampler2D level;    // rgb: weighted sum of light over albedo without fireflies; a: sum of the weights
#endif
layout(rgba32f) writeonly uniform image2D made;

float level_at(ivec2 pixel) {
#ifdef HALFLIGHT_LEVEL
    vec4 sums = texelFetch(level, pixel, 0);
    return squarable_luminance(sums.rgb / max(sums.a, kLeastReach));
#else
    return 1.0;
#endif
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(made)))) return;
    vec4 own = texelFetch(removed, pixel, 0);
#if defined(HALFLIGHT_RECEIVERS)
    vec3 here = level_at(pixel) * texelFetch(albedo, pixel, 0).rgb;
#elif defined(HALFLIGHT_EXCESS)
    vec3 here = own.rgb * texelFetch(albedo, pixel, 0).rgb / max(texelFetch(reach, pixel, 0).rgb, vec3(kLeastLight));
#else
    vec3 here = level_at(pixel) * texelFetch(shares, pixel, 0).rgb;
#endif
    imageStore(made, pixel, own.a > 0.0 ? vec4(here, 0.0) : vec4(0.0));
}
