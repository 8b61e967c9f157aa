// Estimates the error of a rendering method from several independent renders and a reference that is noisy itself.
#pragma once

#include <span>
#include <vector>

#include "engine/core/image.h"
#include "engine/core/statistics.h"

namespace halflight {

/// Expected squared error of one render: the mean over pixels and channels, each value times its weight. These unbiased
/// estimates may be negative if an error is small.
struct SeedErrors {
    Interval mse;           // = squared_bias + variance
    Interval squared_bias;  // squared error of the expectation over all seeds; needs two renders
    Interval variance;      // variance of a render about that expectation; needs two renders
    std::vector<double> of_render;
    double reference_variance = 0;  // variance of the mean of both halves, by which (a - (r1 + r2) / 2)^2 is too high
    double worst_share = 0;         // metrics.h: share of squares about the halves' mean, including the halves' noise
};

/// Estimates the error of `renders`, one or more of independent seeds. `first` and `second` are unbiased references of
/// yet other seeds, however noisy. `weights`: one per value, or empty for 1. Intervals contain the scatter of renders
/// and references if tails are light, or if the noise of many pixels is independent. Precondition: same size and
/// channels.
SeedErrors seed_errors(std::span<const Image> renders, const Image& first, const Image& second,
                       const Image& weights = {});

/// Returns 1 / (r^2 + kRelativeEpsilon), the weights of relative squared errors.
Image relative_weights(const Image& reference);

}  // namespace halflight
