// Moves the light of a neighbouring frame to the pixels of this frame, and compares it with the light there. Pixels
// whose surface the neighbour does not show become pixels with nothing to filter.
layout(local_size_x = 8, local_size_y = 8) in;

uniform sampler2D place;  // xy: pixel of the neighbour; z: 1 where it shows the surface, else 0
uniform sampler2D first;  // halves of this frame, without fireflies
uniform sampler2D second;
uniform sampler2D other_first;  // halves of the neighbour, without fireflies
uniform sampler2D other_second;
uniform sampler2D other_spread;   // rgb: light of the neighbour's fireflies, spread
layout(rgba32f) writeonly uniform image2D near_first;
layout(rgba32f) writeonly uniform image2D near_second;
layout(rgba32f) writeonly uniform image2D near_spread;
// rg: difference of the luminance of the halves; b: its variance; a: 1 where there is a difference, else 0
layout(rgba32f) writeonly uniform image2D differences;

#include "shaders/lib/halves.glsl"

// Returns half the squared difference of two halves: the variance of a half if both have as many samples.
float variance_of(vec2 halves) { return 0.5 * (halves.x - halves.y) * (halves.x - halves.y); }

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(near_first)))) return;
    vec4 from = texelFetch(place, pixel, 0);
    ivec2 there = ivec2(from.xy);
    vec4 one = texelFetch(first, pixel, 0);
    vec4 other_one = texelFetch(other_first, there, 0);
    vec4 other_two = texelFetch(other_second, there, 0);
    bool same = from.z > 0.0 && one.a > 0.0 && other_one.a > 0.0;
    vec2 own = vec2(squarable_luminance(one.rgb), squarable_luminance(texelFetch(second, pixel, 0).rgb));
    vec2 other = vec2(squarable_luminance(other_one.rgb), squarable_luminance(other_two.rgb));
    imageStore(near_first, pixel, same ? other_one : vec4(0.0));
    imageStore(near_second, pixel, same ? other_two : vec4(0.0));
    imageStore(near_spread, pixel, same ? texelFetch(other_spread, there, 0) : vec4(0.0));
    imageStore(differences, pixel, same ? vec4(other - own, variance_of(own) + variance_of(other), 1.0) : vec4(0.0));
}
