// Applies one level of the edge-avoiding a-trous wavelet filter (Dammertz et al. 2010), guided by normal, depth and
// variance (Schied et al. 2017, equations 1 to 5). Neighbours count if noise explains how much their light differs.
#include "shaders/shared/frame.h"

layout(local_size_x = 8, local_size_y = 8) in;

layout(std140) uniform FrameBlock { Frame frame; };
uniform sampler2D noisy;  // rgb: light; a: variance of its luminance
uniform sampler2D guide;
layout(rgba32f) writeonly uniform image2D smoother;  // rgb: filtered light; a: variance of its luminance

uniform int stride;  // pixels from tap to tap

#include "shaders/lib/luminance.glsl"
#include "shaders/lib/preview_surface.glsl"

const float kLuminanceDeviations = 4.0;

// Returns the variance, filtered because it is noisy itself.
float smooth_variance(ivec2 pixel) {
    float sum = 0.0;
    for (int y = -1; y <= 1; ++y)
        for (int x = -1; x <= 1; ++x)
            sum += float((2 - abs(x)) * (2 - abs(y))) / 16.0 *
                   texelFetch(noisy, clamp(pixel + ivec2(x, y), ivec2(0), frame.size - 1), 0).a;
    return sum;
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, frame.size))) return;
    vec4 own = texelFetch(noisy, pixel, 0);
    vec4 surface = texelFetch(guide, pixel, 0);
    vec3 here = place_at_depth(frame, pixel, surface.w);
    float luminance = luminance_of(own.rgb);
    float allowed = kLuminanceDeviations * sqrt(smooth_variance(pixel)) + 1e-10;
    vec4 sum = own;
    float weights = 1.0;
    for (int y = -1; y <= 1; ++y) {
        for (int x = -1; x <= 1; ++x) {
            ivec2 other = pixel + stride * ivec2(x, y);
            bool inside = all(greaterThanEqual(other, ivec2(0))) && all(lessThan(other, frame.size)) && (x | y) != 0;
            other = clamp(other, ivec2(0), frame.size - 1);
            vec4 there = texelFetch(noisy, other, 0);
            float weight = float((2 - abs(x)) * (2 - abs(y))) / 4.0 *  // 1 at the centre
                           likeness(frame, pixel, surface, here, other, texelFetch(guide, other, 0)) *
                           exp(-abs(luminance_of(there.rgb) - luminance) / allowed);
            weight = inside ? weight : 0.0;
            sum += vec4(weight, weight, weight, weight * weight) * there;
            weights += weight;
        }
    }
    imageStore(smoother, pixel, sum / vec4(vec3(weights), weights * weights));
}
