// Replaces the squares of each pixel by squares that give the variance of its mean as if it had `wanted` samples. Needs
// the sums before adaptive_mean.comp.
layout(local_size_x = 64) in;

#include "shaders/lib/beauty_sums.glsl"
layout(std430) buffer Squares { double squares[]; };
uniform usamplerBuffer counts;  // R32UI: number of samples of each 16x16 block

uniform uint wanted;

void main() {
    uint path = gl_GlobalInvocationID.x;
    double n = double(texelFetch(counts, int(path >> 8)).x);
    double all = double(wanted);
    for (uint i = 0u; i < 3u; ++i) {
        double mean = beauty_sum(path, i) / n;
        double of_mean = max(squares[path * 3u + i] / n - mean * mean, 0.0LF) / (n - 1.0LF);
        squares[path * 3u + i] = all * (mean * mean + (all - 1.0LF) * of_mean);
    }
}
