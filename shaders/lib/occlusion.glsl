// What an answer of any_hit makes of light.
#include "shaders/lib/finite.glsl"
#include "shaders/shared/rays.h"

// Light without contribution asked for no answer. One that could not be given (kUnfinished) must not pass for either: it is NaN,
// which the accumulation counts.
vec3 answered_light(vec3 light, uint occluded) {
    vec3 answered = occluded == kFree ? light : occluded == kOccluded ? vec3(0.0) : vec3(not_a_number());
    return light == vec3(0.0) ? light : answered;
}
