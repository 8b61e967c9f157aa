// Adds the light of a neighbouring frame to the mean of halves over frames, as far as noise explains how it differs
// from this frame. Differences in one half decide about the other one.
layout(local_size_x = 8, local_size_y = 8) in;

uniform sampler2D near_first;
uniform sampler2D near_second;
uniform sampler2D near_spread;  // rgb: light of the neighbour's fireflies, spread
uniform sampler2D pooled;  // rg: weighted sum of differences; b: of their variances; a: of the weights
uniform sampler2D before_first;  // rgb: mean of earlier frames; a: sum of their weights
uniform sampler2D before_second;
uniform sampler2D before_spread;
layout(rgba32f) writeonly uniform image2D mean_first;
layout(rgba32f) writeonly uniform image2D mean_second;
layout(rgba32f) writeonly uniform image2D mean_spread;

uniform bool begins;           // the earlier frame is this frame, which has weight 1
uniform float pooled_squares;  // sum of the squares of the weights of `pooled`

#include "shaders/shared/denoise.h"

const float kExplained = 6.0;  // squared difference that noise explains, in variances, which few samples underestimate
// Least variance: differences below its root count as none.
const float kLeastVariance = 1e-6;

// Returns the new mean with the sum of the weights.
vec4 added(vec4 before, vec4 near, float weight) {
    float all = (begins ? 1.0 : before.a) + weight;
    return vec4(before.rgb + weight / all * (near.rgb - before.rgb), all);
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(mean_first)))) return;
    vec4 near = texelFetch(near_first, pixel, 0);
    vec4 sums = texelFetch(pooled, pixel, 0);
    float variance = pooled_squares * sums.b + kLeastVariance * sums.a * sums.a;
    vec2 squares = sums.rg * sums.rg / max(variance, kLeastReach * kLeastReach);
    vec2 weights = near.a > 0.0 ? exp(-max(squares / kExplained - 1.0, vec2(0.0))) : vec2(0.0);
    imageStore(mean_first, pixel, added(texelFetch(before_first, pixel, 0), near, weights.y));
    imageStore(mean_second, pixel,
               added(texelFetch(before_second, pixel, 0), texelFetch(near_second, pixel, 0), weights.x));
    imageStore(mean_spread, pixel,
               added(texelFetch(before_spread, pixel, 0), texelFetch(near_spread, pixel, 0), min(weights.x, weights.y)));
}
