// Error metrics of an image against a reference, as maps and as single numbers.
#pragma once

#include <span>

#include "engine/core/image.h"

namespace halflight {

/// Regularization of the relative error of dark pixels. Where the reference is far below 0.1, the square root of this
/// constant, errors count as absolute.
inline constexpr double kRelativeEpsilon = 0.01;

/// Returns (value - reference)^2 / (reference^2 + kRelativeEpsilon) (Rousselle, Knaus, Zwicker 2011, Adaptive Sampling
/// and Reconstruction using Greedy Error Minimization, section 5).
inline double relative_squared_error(double value, double reference) {
    const double error = value - reference;
    return error * error / (reference * reference + kRelativeEpsilon);
}

/// Returns the mean relative squared error without the share `left_out` of the values with the largest errors; 0
/// without values. Precondition: both spans have the same length.
double relative_mse(std::span<const double> values, std::span<const double> reference, double left_out = 0);

/// Returns a map with one channel: the mean of the (relative) squared error over the image's channels. Precondition:
/// both images have the same size and channels.
Image squared_error_map(const Image& image, const Image& reference);
Image relative_squared_error_map(const Image& image, const Image& reference);

/// Returns the mean over all values; 0 without values.
double mean_of(const Image& map);

/// Share of all pixels, at least one pixel, that counts as the worst pixels when a report measures heavy tails.
inline constexpr double kWorstShare = 0.001;
/// Returns the share, in [0, 1], of a map's sum that its worst pixels hold; 0 if all values are 0. Precondition: no
/// value is negative.
double worst_share(std::span<const float> map, double worst = kWorstShare);

}  // namespace halflight
