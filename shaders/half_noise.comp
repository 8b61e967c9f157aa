// Computes half the squared difference of two halves: the variance of a half if both have as many samples. Alpha is 1
// where there is light to filter, else 0.
layout(local_size_x = 8, local_size_y = 8) in;

uniform sampler2D first;
uniform sampler2D second;
layout(rgba32f) writeonly uniform image2D noise;

#include "shaders/lib/halves.glsl"

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(noise)))) return;
    vec4 one = texelFetch(first, pixel, 0);
    float apart = squarable_luminance(one.rgb) - squarable_luminance(texelFetch(second, pixel, 0).rgb);
    imageStore(noise, pixel, vec4(vec3(0.5 * apart * apart), one.a > 0.0 ? 1.0 : 0.0));
}
