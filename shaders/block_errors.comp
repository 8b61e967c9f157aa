// Estimates the variance of one sample as the mean over each 16x16 block of a band, optionally relative to the squared
// mean.
layout(local_size_x = 64) in;

const bool kCatchers = HALFLIGHT_CATCHERS != 0;

#include "shaders/lib/beauty_sums.glsl"
OPTIONAL(HALFLIGHT_CATCHERS) layout(std430) readonly buffer Catchers { double catchers[]; };  // Accumulated::catchers
layout(std430) readonly buffer Squares { double squares[]; };
layout(std430) writeonly buffer Errors { float errors[]; };

uniform uint samples;  // number of samples in the sums, at least 2
uniform uint blocks;
// The variance is divided by relative * mean^2 + epsilon: 1 and kRelativeEpsilon of engine/core/metrics.h, or 0 and 1.
uniform float relative;
uniform float epsilon;

// Returns a variance relative to the mean, as the metric wants it.
double weighted(double variance, double mean) {
    return variance / (double(relative) * mean * mean + double(epsilon));
}

// Returns the variance of the shadow 1 - lit / unlit by one sample, to first order.
double shadow_variance(uint path, double n) {
    uint first = path * 9u;
    double unlit = catchers[first + 1u];
    if (!(unlit > 0.0LF)) return 0.0LF;
    double share = catchers[first] / unlit;
    double squares = catchers[first + 6u] - 2.0LF * share * catchers[first + 7u] + share * share * catchers[first + 8u];
    return max(squares, 0.0LF) * n * n / (unlit * unlit * (n - 1.0LF));
}

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
        if (kCatchers) {
            double behind = catchers[path * 9u + 3u + value % 3u] / n, met = catchers[path * 9u + 2u] / n;
            double of_shadow = shadow_variance(path, n);
            variance += behind * behind * of_shadow;
            if (value % 3u == 0u) sum += weighted(met * met * of_shadow, emission[path * 4u + 3u] / n);
        }
        sum += weighted(variance, mean);
    }
    errors[block] = float(min(sum / 768.0LF, 3.0e38LF));
}
