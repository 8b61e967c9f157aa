// Clamps each pixel to the range between the darkest and the brightest pixel around it. This removes single outliers
// that the filter has left.
layout(local_size_x = 8, local_size_y = 8) in;

uniform sampler2D light;
uniform sampler2D guide;
layout(rgba32f) writeonly uniform image2D calm;

#include "shaders/lib/luminance.glsl"

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    ivec2 size = imageSize(calm);
    if (any(greaterThanEqual(pixel, size))) return;
    vec4 own = texelFetch(light, pixel, 0);
    vec3 brightest = vec3(0.0);
    vec3 darkest = vec3(0.0);
    float most = -1.0;  // luminance of `brightest`; negative: none was seen
    float least = -1.0;
    for (int y = -1; y <= 1; ++y) {
        for (int x = -1; x <= 1; ++x) {
            ivec2 other = pixel + ivec2(x, y);
            bool inside = all(greaterThanEqual(other, ivec2(0))) && all(lessThan(other, size)) && (x | y) != 0;
            other = clamp(other, ivec2(0), size - 1);
            vec3 there = texelFetch(light, other, 0).rgb;
            float value = luminance_of(there);
            bool counts = inside && texelFetch(guide, other, 0).w > 0.0;
            bool brighter = counts && value > most;
            bool darker = counts && (least < 0.0 || value < least);
            brightest = brighter ? there : brightest;
            most = brighter ? value : most;
            darkest = darker ? there : darkest;
            least = darker ? value : least;
        }
    }
    float value = luminance_of(own.rgb);
    bool outlier = most >= 0.0 && (value > most || value < least);
    imageStore(calm, pixel, vec4(outlier ? (value > most ? brightest : darkest) : own.rgb, own.a));
}
