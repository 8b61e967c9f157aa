// Computes the terms of the best share of filtered light. Errors of the picture are weighed as in relMSE, or else a
// highlight would decide for all pixels near it.
layout(local_size_x = 8, local_size_y = 8) in;

uniform sampler2D first;
uniform sampler2D second;
uniform sampler2D filtered_first;
uniform sampler2D filtered_second;
uniform sampler2D albedo;
uniform sampler2D surroundings;  // rgb: smoothed picture
layout(rgba32f) writeonly uniform image2D terms;

#include "shaders/lib/halves.glsl"

const float kRelativeEpsilon = 0.01;  // engine/core/metrics.h

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(terms)))) return;
    vec4 one = texelFetch(first, pixel, 0);
    vec3 two = texelFetch(second, pixel, 0).rgb;
    float radiance = squarable_luminance(texelFetch(surroundings, pixel, 0).rgb);
    float scale = luminance_of(texelFetch(albedo, pixel, 0).rgb) * inversesqrt(radiance * radiance + kRelativeEpsilon);
    vec2 own = change_terms(texelFetch(filtered_first, pixel, 0).rgb - one.rgb,
                            texelFetch(filtered_second, pixel, 0).rgb - two, two - one.rgb, one.a, scale);
    float apart = clamp(own.x - own.y, -kMostSquared, kMostSquared);
    imageStore(terms, pixel, one.a > 0.0 ? vec4(own, apart * apart, 1.0) : vec4(0.0));
}
