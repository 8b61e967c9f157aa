// Renders with the oracle in tests, and averages whole images.
#pragma once

#include "engine/reference/reference.h"

namespace halflight::test {

/// Renders a square image of `size` pixels.
ReferenceResult render_oracle(const Scene& scene, const Camera& camera, int size, int samples, int bounces,
                              std::uint64_t seed = 1);

/// Mean of one channel over all pixels.
struct MeanRadiance {
    double value = 0;
    double error = 0;  // standard error, from the variances per sample
};
MeanRadiance mean_radiance(const ReferenceResult& result, int channel = 0);

}  // namespace halflight::test
