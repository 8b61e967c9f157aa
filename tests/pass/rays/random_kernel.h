// Provides the small kernels of tests with random numbers.
#pragma once

#include <epoxy/gl.h>

#include <string>

#include "engine/gpu/buffer.h"
#include "engine/gpu/program.h"

namespace halflight {

/// GLSL code that follows shaders/lib/sobol.glsl: random numbers from `state`, which the kernel sets.
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

/// Dispatches a random search, whose kernel counts in the storage block "Counts"; returns the counts. `set` sets its
/// other inputs.
template <class Counts, class Set>
Counts random_search(const std::string& kernel, const gpu::Defines& defines, std::uint32_t invocations,
                     const Set& set) {
    const gpu::Program program = gpu::Program::compute({"random search", kernel}, defines);
    const gpu::Buffer counts("counts", sizeof(Counts));
    program.bind_storage("Counts", counts);
    program.set("seed", 1u);
    set(program);
    program.dispatch(invocations / 64);
    glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
    return counts.read<Counts>().front();
}

}  // namespace halflight
