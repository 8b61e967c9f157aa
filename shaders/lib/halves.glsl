// Two halves of a pixel's samples (passes/picture/denoiser.h). Alpha is the share of the first half, 0 where there is
// nothing to filter.
#include "shaders/lib/luminance.glsl"
#include "shaders/shared/denoise.h"

// Returns the mean of all samples.
vec3 mean_of(vec4 first, vec4 second) { return mix(second.rgb, first.rgb, first.a); }

// Returns a value whose square is finite.
vec3 squarable(vec3 v) { return clamp(v, vec3(-kMostSquared), vec3(kMostSquared)); }

float squarable_luminance(vec3 v) { return min(luminance_of(v), kMostSquared); }
