// Two halves of a pixel's samples (passes/picture/denoiser.h). Alpha is the share of the first half, 0 where there is
// nothing to filter.
#include "shaders/lib/luminance.glsl"
#include "shaders/shared/denoise.h"

// Returns the mean of all samples.
vec3 mean_of(vec4 first, vec4 second) { return mix(second.rgb, first.rgb, first.a); }

// Returns a value whose square is finite.
vec3 squarable(vec3 v) { return clamp(v, vec3(-kMostSquared), vec3(kMostSquared)); }

float squarable_luminance(vec3 v) { return min(luminance_of(v), kMostSquared); }

// Returns the terms of the share of a change that minimises the squared error of the mean. The first one is the product
// of the change and the error, negated. The second one is the square of the change. The quotient of their means is the
// best share. Each half serves as an estimate of the truth whose noise is independent of the other half. apart: second
// half minus first half.
vec2 change_terms(vec3 change_first, vec3 change_second, vec3 apart, float share_first, float scale) {
    vec2 share = vec2(share_first, 1.0 - share_first);
    vec3 one = squarable(scale * change_first);
    vec3 two = squarable(scale * change_second);
    vec3 change = share.x * one + share.y * two;
    return vec2(dot(squarable(scale * apart), share.x * share.x * one - share.y * share.y * two), dot(change, change));
}

// Returns the best share, raised by its standard errors. Noise with heavy tails lets single pixels decide about averages,
// so that a share below 1 must be significant. terms: averages of change_terms(), and of the squared difference of the
// two. squares: sum of the squares of the weights of the averages, whose sum is 1.
float significant_share(vec3 terms, float squares) {
    const float kSignificance = 2.0;  // standard errors
    float bound = terms.x + kSignificance * sqrt(squares * terms.z);
    return terms.y > 0.0 ? clamp(bound / terms.y, 0.0, 1.0) : 0.0;
}

float best_share(vec2 terms) { return terms.y > 0.0 ? clamp(terms.x / terms.y, 0.0, 1.0) : 0.0; }
