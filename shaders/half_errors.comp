// Computes the terms of the share of filtered light that minimises the squared error. Each half serves as an estimate of
// the truth that is independent of the other half's noise.
layout(local_size_x = 8, local_size_y = 8) in;

uniform sampler2D first;
uniform sampler2D second;
uniform sampler2D filtered_first;
uniform sampler2D filtered_second;
uniform sampler2D spread;  // rgb: light of fireflies, spread
// r: product of the filter's change and the noise, expected; g: square of the filter's change. Their quotient is the
// best share.
layout(rgba32f) writeonly uniform image2D terms;

#include "shaders/lib/halves.glsl"

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(terms)))) return;
    vec4 one = texelFetch(first, pixel, 0);
    vec4 two = texelFetch(second, pixel, 0);
    vec3 added = texelFetch(spread, pixel, 0).rgb;
    vec3 change_one = squarable(texelFetch(filtered_first, pixel, 0).rgb + added - one.rgb);
    vec3 change_two = squarable(texelFetch(filtered_second, pixel, 0).rgb + added - two.rgb);
    vec3 apart = squarable(two.rgb - one.rgb);
    vec2 share = vec2(one.a, 1.0 - one.a);
    vec3 change = share.x * change_one + share.y * change_two;
    float product = dot(apart, share.x * share.x * change_one - share.y * share.y * change_two);
    imageStore(terms, pixel, one.a > 0.0 ? vec4(product, dot(change, change), 0.0, 1.0) : vec4(0.0));
}
