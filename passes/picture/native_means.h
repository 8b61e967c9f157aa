// Non-local means on the processor, for drivers that render there: the method of shaders/nl_means.comp, which tells the
// equations. Sums of neighbouring pixels stay in registers and in the first cache, whereas such drivers run the
// barriers and the shared memory of the shader slowly. Results differ from the shader's by rounding.
#pragma once

#include <span>

#include "engine/core/math.h"

namespace halflight {

/// Kernel of non-local means. Offsets are (stride x, stride y) with |x|, |y| <= window.
struct MeansKernel {
    int patch;   // radius of patches, pixels: 1 or 3
    int window;  // radius of the window, multiples of stride
    int stride;  // distance of the offsets, pixels; window * stride <= kMostOffset
};
inline constexpr int kMostOffset = 16;
inline constexpr MeansKernel kFinalMeans{3, 7, 1};
constexpr MeansKernel small_means(int stride) {
    return {1, 2, stride};
}

/// Pictures of size.x * size.y texels, first row first: the textures of shaders/nl_means.comp.
struct MeansInput {
    std::span<const float> light, first, second, guide, reflectance;  // four floats per texel
};
struct MeansOutput {
    std::span<float> first, second;  // four floats per texel
};

/// Filters two halves with all threads that native tracing takes (native_threads()). Every size is >= 1.
void filter_natively(const MeansKernel& kernel, ivec2 size, const MeansInput& input, const MeansOutput& output);

/// Bytes per pixel that filter_natively() and its pictures take.
inline constexpr std::size_t kNativeMeansBytes = (7 + 5) * sizeof(vec4);

}  // namespace halflight
