// Rendering with the oracle in tests, and what to expect of a whole image.
#pragma once

#include "engine/reference/reference.h"

namespace halflight::test {

/// Square image of `size` pixels.
ReferenceResult render_oracle(const Scene& scene, const Camera& camera, int size, int samples, int bounces,
                              std::uint64_t seed = 1);

/// Mean over all pixels of one channel, with its standard error from the per-sample variances.
struct MeanRadiance {
    double value = 0;
    double error = 0;
};
MeanRadiance mean_radiance(const ReferenceResult& result, int channel = 0);

}  // namespace halflight::test
