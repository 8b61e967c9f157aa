// Adaptive sampling: where samples go, and the mean of pixels with different numbers of samples.
//
// A pilot with random numbers of its own decides how many samples each 16x16 block takes, and is thrown away. The
// values of a pixel are independent of their number, so its mean is unbiased (Kirk and Arvo 1991, Unbiased Sampling
// Techniques for Image Synthesis). All numbers are powers of two, for which sequences are best distributed and have
// equal halves. A picture that is rendered up to an error grows until its error is met, so its numbers are not rounded.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "engine/device/scene_view.h"
#include "engine/settings/frame_settings.h"
#include "passes/steps/sums.h"

namespace halflight {

inline constexpr int kLeastAdaptiveSamples = 16;  ///< least number of samples of a picture that is sampled adaptively

/// Returns the number of samples of the pilot, which come on top of `samples`: a power of two from 4 to 32.
int pilot_samples(int samples);
/// Returns the least number of samples of a block: a power of two, at least 4, from a sixteenth to an eighth of all.
int least_samples(int samples);

/// Adds the pass that estimates the variance of one sample, averaged over each block. For ErrorMetric::relmse, it is
/// relative to the squared mean. Returns a float per block, in the order of pixel_order.h. samples: number of samples
/// in the sums, at least 2.
graph::BufferHandle add_block_errors(graph::Graph& graph, const Band& band, const Accumulated& sums, int samples,
                                     ErrorMetric metric);

/// Returns the standard deviation of one sample of each block, from variances that are smoothed over neighbouring
/// blocks. The mean error is least if numbers of samples are in proportion to it. errors: of the pilot, by rows of
/// blocks.x blocks from the top; values that are not finite count as 0.
std::vector<double> block_deviations(std::span<const float> errors, ivec2 blocks);

/// Returns the number of samples of each 16x16 block of the picture: powers of two, at least `least` (a power of two),
/// whose sum is about `total`. errors: of the pilot. Both go by rows of blocks.x blocks from the top. Before rounding,
/// numbers are in proportion to block_deviations().
std::vector<std::uint32_t> adaptive_counts(std::span<const float> errors, ivec2 blocks, std::uint32_t least,
                                           std::uint64_t total);

/// Returns the expected number of samples per pixel, at least 1, at which the mean error falls to `target` (> 0) if
/// numbers of samples are in proportion to the deviations. Samples are taken as independent.
int expected_samples(std::span<const double> deviations, double target);

/// Returns the number of samples of each block in each replicate of a picture that is rendered up to an error. They are
/// in proportion to the deviations, but at least `least` and an eighth of `mean`. Their mean is at most `mean` (at
/// least `least`), and nearly that unless a block reaches `most` samples. No number falls as `mean` grows.
std::vector<std::uint32_t> replicate_counts(std::span<const double> deviations, std::uint32_t mean, std::uint32_t least,
                                            std::uint32_t most);

/// Numbers of samples of each block of a band, in the order of pixel_order.h: buffers of uint.
struct BlockCounts {
    graph::BufferHandle all;         // at least 2
    graph::BufferHandle first_half;  // samples in the first of the two halves that the denoiser compares, at least 1
};

/// Adds the passes that scale sums as if every pixel had `wanted` samples, half of them in the first half. Squares then
/// give the variance of the mean. wanted: even. half_sums, group_sums: doubles per path of Accumulated::halves and
/// groups.
void add_adaptive_mean(graph::Graph& graph, const Band& band, const Accumulated& sums, const BlockCounts& counts,
                       std::uint32_t wanted, std::size_t half_sums, std::size_t group_sums);

}  // namespace halflight
