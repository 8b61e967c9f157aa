// Application of answers to shadow rays to light: results of any_hit(), or the light that has passed panes.
#include "shaders/lib/finite.glsl"
#include "shaders/shared/ray_structs.h"

// An answer with this bit has the light that panes let pass, as colour of 9 bits per channel and a common exponent.
const uint kPassedPanes = 0x80000000u;
const float kPassedSteps = 511.0;

// Returns the answer for a share of light, each channel in [0, 1]. random, in [0, 1), rounds without bias.
uint answer_of_panes(vec3 share, vec3 random) {
    float most = max(share.r, max(share.g, share.b));
    if (most == 0.0) return kOccluded;
    float exponent = clamp(floor(-log2(most)), 0.0, 15.0);
    uvec3 steps = min(uvec3(share * exp2(exponent) * kPassedSteps + random), uvec3(kPassedSteps));
    return kPassedPanes | uint(exponent) << 27 | steps.r << 18 | steps.g << 9 | steps.b;
}

// Returns the share of light of an answer that is neither kFree nor kOccluded.
vec3 share_of_answer(uint answer) {
    uvec3 steps = (uvec3(answer) >> uvec3(18u, 9u, 0u)) & 511u;
    vec3 passed = vec3(steps) * (exp2(-float((answer >> 27) & 15u)) / kPassedSteps);
    return (answer & kPassedPanes) != 0u ? passed : vec3(not_a_number());
}

// Returns the light that arrives. Light without contribution needs no result. An unfinished result (kUnfinished) must
// count neither as lit nor as shadowed: it becomes NaN, which the accumulation counts.
vec3 answered_light(vec3 light, uint occluded) {
    vec3 answered = occluded == kFree ? light : occluded == kOccluded ? vec3(0.0) : light * share_of_answer(occluded);
    return light == vec3(0.0) ? light : answered;
}
