// Application of any_hit() results to light.
#include "shaders/lib/finite.glsl"
#include "shaders/shared/rays.h"

// Returns the light that arrives. Light without contribution needs no result. An unfinished result (kUnfinished) must
// count neither as lit nor as shadowed: it becomes NaN, which the accumulation counts.
vec3 answered_light(vec3 light, uint occluded) {
    vec3 answered = occluded == kFree ? light : occluded == kOccluded ? vec3(0.0) : vec3(not_a_number());
    return light == vec3(0.0) ? light : answered;
}
