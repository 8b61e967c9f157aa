// Estimates the variance of each pixel's light before filtering (Schied et al. 2017, section 4.2). Pixels with few
// samples use those of their neighbourhood.
#include "shaders/shared/frame.h"

layout(local_size_x = 8, local_size_y = 8) in;

layout(std140) uniform FrameBlock { Frame frame; };
// passes/preview/preview_texels.h describes the content of these textures.
uniform sampler2D light;
uniform sampler2D guide;
uniform sampler2D place;
layout(rgba32f) writeonly uniform image2D noisy;  // rgb: light; a: variance of the luminance of that mean

#include "shaders/lib/luminance.glsl"
#include "shaders/lib/preview_surface.glsl"

const int kRadius = 2;  // pixels around a pixel, in x and y
const float kFewSamples = 2.0;   // number of samples too small for an estimate
const float kManySamples = 8.0;  // number of samples that suffices

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, frame.size))) return;
    vec4 own = texelFetch(light, pixel, 0);
    vec4 surface = texelFetch(guide, pixel, 0);
    float samples = texelFetch(place, pixel, 0).w;
    vec3 here = place_at_depth(frame, pixel, surface.w);
    float count = 0.0;
    float sum = 0.0;
    float squares = 0.0;
    for (int y = -kRadius; y <= kRadius; ++y) {
        for (int x = -kRadius; x <= kRadius; ++x) {
            ivec2 other = clamp(pixel + ivec2(x, y), ivec2(0), frame.size - 1);
            float weight = likeness(frame, pixel, surface, here, other, texelFetch(guide, other, 0));
            float value = luminance_of(texelFetch(light, other, 0).rgb);
            count += weight;
            sum += weight * value;
            squares += weight * value * value;
        }
    }
    float mean = sum / max(count, 1e-30);
    float around = max(squares / max(count, 1e-30) - mean * mean, 0.0);
    float luminance = luminance_of(own.rgb);
    float of_samples = max(own.a - luminance * luminance, 0.0) / max(samples - 1.0, 1.0);
    float trust = clamp((samples - kFewSamples) / (kManySamples - kFewSamples), 0.0, 1.0);
    imageStore(noisy, pixel, vec4(own.rgb, mix(around, of_samples, trust)));
}
