// Estimates the variance of one sample, relative to the squared mean, as the mean over each 16x16 block of a band.
layout(local_size_x = 64) in;

#include "shaders/lib/beauty_sums.glsl"
layout(std430) readonly buffer Squares { double squares[]; };
layout(std430) writeonly buffer Errors { float errors[]; };

uniform uint samples;  // number of samples in the sums, at least 2
uniform uint blocks;
uniform float epsilon;  // added to the squared mean, kRelativeEpsilon of engine/core/metrics.h

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
        sum += variance / (mean * mean + double(epsilon));
    }
    errors[block] = float(sum / 768.0LF);
}
