// Provides the small kernels of tests with random numbers.
#pragma once

#include <string>

namespace halflight {

/// GLSL code that follows shaders/lib/hash.glsl: random numbers from `state`, which the kernel sets.
inline const std::string kRandomNumbers = R"(
uint state;
uint next() {
    state = state * 747796405u + 2891336453u;
    return hash_u32(state);
}
bool one_of(uint n) { return next() % n == 0u; }
float unit() { return float(next() >> 8) * 5.9604645e-8; }
float between(float a, float b) { return a + (b - a) * unit(); }
float power_of_ten(float a, float b) { return exp2(3.3219281 * between(a, b)); }
vec3 cube() { return vec3(between(-1.0, 1.0), between(-1.0, 1.0), between(-1.0, 1.0)); }
)";

}  // namespace halflight
