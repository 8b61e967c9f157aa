// Caps outliers of two halves by the mean around them. The excess is divided by the sum of the weights with which it
// will be spread, so that no light is lost.
layout(local_size_x = 8, local_size_y = 8) in;

uniform sampler2D first;
uniform sampler2D second;
uniform sampler2D around;  // rgb: weighted sum of the mean of the halves; a: sum of the weights
uniform sampler2D reach;   // a: sum of the weights of the pixels over which the excess is spread
layout(rgba32f) writeonly uniform image2D calm_first;
layout(rgba32f) writeonly uniform image2D calm_second;
layout(rgba32f) writeonly uniform image2D excess;

#include "shaders/lib/halves.glsl"

const float kMostOfMean = 10.0;  // an outlier's luminance over that of the mean around it

// Returns the share of a value that is kept.
float kept(vec3 value, float most) {
    float own = luminance_of(value);
    return own > most ? most / own : 1.0;
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(excess)))) return;
    vec4 one = texelFetch(first, pixel, 0);
    vec4 two = texelFetch(second, pixel, 0);
    vec4 sums = texelFetch(around, pixel, 0);
    float most = one.a > 0.0 ? kMostOfMean * luminance_of(sums.rgb / sums.a) : 0.0;
    vec4 calm_one = vec4(one.rgb * kept(one.rgb, most), one.a);
    vec4 calm_two = vec4(two.rgb * kept(two.rgb, most), two.a);
    vec3 rest = one.a > 0.0 ? mean_of(one - calm_one + vec4(0.0, 0.0, 0.0, one.a), two - calm_two) : vec3(0.0);
    imageStore(calm_first, pixel, calm_one);
    imageStore(calm_second, pixel, calm_two);
    imageStore(excess, pixel, one.a > 0.0 ? vec4(rest / texelFetch(reach, pixel, 0).a, 1.0) : vec4(0.0));
}
