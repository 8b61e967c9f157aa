// Estimates the variance of one sample as the mean over each 16x16 block of a band, optionally relative to the squared
// mean.
layout(local_size_x = 64) in;

#include "shaders/lib/beauty_sums.glsl"
layout(std430) readonly buffer Squares { double squares[]; };
layout(std430) writeonly buffer Errors { float errors[]; };

uniform uint samples;  // number of samples in the sums, at least 2
uniform uint blocks;
// The variance is divided by relative * mean^2 + epsilon: 1 and kRelativeEpsilon of engine/core/metrics.h, or 0 and 1.
uniform float relative;
uniform float epsilon;

void main() {
    uint block = gl_GlobalInvocationID.x;
    if (block >= blocks) return;
    double n = double(samples);
    double sum = 0.0LF;
    for (uint value = 0u; value < 768u; ++value) {
        uint path = block * 256u + value / 3u;
        double light = beauty_sum(path, value % 3u);
        double mean = light / n;
        double variance = max(squares[path * 3u + value % 3u] - light * mean, 0.0LF) / (n - 1.0LF);
        sum += variance / (double(relative) * mean * mean + double(epsilon));
    }
    errors[block] = float(min(sum / 768.0LF, 3.0e38LF));
}
