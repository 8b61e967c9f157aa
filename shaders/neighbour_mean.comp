// Replaces the halves of a frame by means over frames, as far as they are expected to be nearer to the truth.
layout(local_size_x = 8, local_size_y = 8) in;

uniform sampler2D first;
uniform sampler2D second;
uniform sampler2D spread;  // rgb: light of fireflies, spread
uniform sampler2D mean_first;  // rgb: mean over frames
uniform sampler2D mean_second;
uniform sampler2D mean_spread;
uniform sampler2D errors;  // rg: terms of the best share of the mean, averaged
layout(rgba32f) writeonly uniform image2D steady_first;
layout(rgba32f) writeonly uniform image2D steady_second;
layout(rgba32f) writeonly uniform image2D steady_spread;  // a: share of the mean over frames

#include "shaders/lib/halves.glsl"

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(steady_first)))) return;
    vec4 one = texelFetch(first, pixel, 0);
    vec4 two = texelFetch(second, pixel, 0);
    float share = one.a > 0.0 ? best_share(texelFetch(errors, pixel, 0).rg) : 0.0;
    imageStore(steady_first, pixel, vec4(one.rgb + share * (texelFetch(mean_first, pixel, 0).rgb - one.rgb), one.a));
    vec3 own = texelFetch(spread, pixel, 0).rgb;
    imageStore(steady_spread, pixel, vec4(own + share * (texelFetch(mean_spread, pixel, 0).rgb - own), share));
    imageStore(steady_second, pixel, vec4(two.rgb + share * (texelFetch(mean_second, pixel, 0).rgb - two.rgb), two.a));
}
