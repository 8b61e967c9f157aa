// How far an image is from a reference: pixel by pixel, and as one number.
#pragma once

#include <span>

#include "engine/core/image.h"

namespace halflight {

/// What keeps the relative error of dark pixels finite: errors at a radiance far below its root, 0.1, count absolutely.
inline constexpr double kRelativeEpsilon = 0.01;

/// (value - reference)^2 / (reference^2 + kRelativeEpsilon) (Rousselle, Knaus, Zwicker 2011, Adaptive Sampling and
/// Reconstruction using Greedy Error Minimization, section 5).
inline double relative_squared_error(double value, double reference) {
    const double error = value - reference;
    return error * error / (reference * reference + kRelativeEpsilon);
}

/// Its mean over all values but for this share of them, the worst ones; 0 without values. Precondition: as many of
/// both.
double relative_mse(std::span<const double> values, std::span<const double> reference, double left_out = 0);

/// Maps have one channel: the mean over the images' channels of the (relative) squared error. Precondition: images of
/// the same size and channels.
Image squared_error_map(const Image& image, const Image& reference);
Image relative_squared_error_map(const Image& image, const Image& reference);

/// Mean over all values; 0 without any.
double mean_of(const Image& map);

/// The worst pixels that heavy tails are told by: this share of all, at least one.
inline constexpr double kWorstShare = 0.001;
/// Share in the sum of a map without negative values that its worst pixels hold, in [0, 1]; 0 where all are 0.
double worst_share(std::span<const float> map, double worst = kWorstShare);

}  // namespace halflight
