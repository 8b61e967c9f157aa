// Computes the mean of two halves. Alpha is 1 where there is light to filter, else 0.
layout(local_size_x = 8, local_size_y = 8) in;

uniform sampler2D first;
uniform sampler2D second;
layout(rgba32f) writeonly uniform image2D mean;

#include "shaders/lib/halves.glsl"

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(mean)))) return;
    vec4 one = texelFetch(first, pixel, 0);
    imageStore(mean, pixel, vec4(mean_of(one, texelFetch(second, pixel, 0)), one.a > 0.0 ? 1.0 : 0.0));
}
