// The error of a way to render, told from several independent renders and from a reference that is noisy itself.
#pragma once

#include <span>
#include <vector>

#include "engine/core/image.h"
#include "engine/core/statistics.h"

namespace halflight {

/// Expected squared error of one render, mean over pixels and channels, each value times its weight. Estimates: where
/// little is left of an error, they may come out below 0.
struct SeedErrors {
    Interval mse;           // = squared_bias + variance
    Interval squared_bias;  // of the mean over all seeds that there could be; needs two renders
    Interval variance;      // of a render about that mean; needs two
    std::vector<double> of_render;
    double reference_variance = 0;  // of the mean of the two halves: by so much (a - (r1 + r2) / 2)^2 would be too high
    double worst_share = 0;         // metrics.h, of squares about the halves' mean, their noise included
};

/// `renders` (one or more) are of independent seeds; `first` and `second` are references of yet other seeds, both
/// unbiased, of whatever noise. `weights`: one per value, or empty for 1. Precondition: all of the same size and
/// channels. Intervals hold the scatter of the renders and of the references, for light tails or many pixels whose
/// noise is independent.
SeedErrors seed_errors(std::span<const Image> renders, const Image& first, const Image& second,
                       const Image& weights = {});

/// 1 / (r^2 + kRelativeEpsilon), which makes squared errors relative ones.
Image relative_weights(const Image& reference);

}  // namespace halflight
