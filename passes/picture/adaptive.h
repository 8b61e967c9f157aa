// Adaptive sampling: where samples go, and the mean of pixels with different numbers of samples.
//
// A pilot with random numbers of its own decides how many samples each 16x16 block takes, and is thrown away. The
// values of a pixel are independent of their number, so its mean is unbiased (Kirk and Arvo 1991, Unbiased Sampling
// Techniques for Image Synthesis). All numbers are powers of two, for which sequences are best distributed and have
// equal halves.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "engine/device/scene_view.h"
#include "passes/picture/accumulate.h"

namespace halflight {

inline constexpr int kLeastAdaptiveSamples = 16;  ///< least number of samples of a picture that is sampled adaptively

/// Returns the number of samples of the pilot, which come on top of `samples`: a power of two from 4 to 32.
int pilot_samples(int samples);
/// Returns the least number of samples of a block: a power of two, at least 4, from a sixteenth to an eighth of all.
int least_samples(int samples);

/// Adds the pass that estimates the variance of one sample, relative to the squared mean and averaged over each block.
/// Returns a float per block, in the order of pixel_order.h. samples: number of samples in the sums, at least 2.
graph::BufferHandle add_block_errors(graph::Graph& graph, const Band& band, const Accumulated& sums, int samples);

/// Returns the number of samples of each 16x16 block of the picture: powers of two, at least `least` (a power of two),
/// whose sum is about `total`. errors: of the pilot. Both go by rows of blocks.x blocks from the top. Before rounding,
/// numbers are in proportion to the square root of the error, smoothed over neighbouring blocks, which minimizes the
/// mean error.
std::vector<std::uint32_t> adaptive_counts(std::span<const float> errors, ivec2 blocks, std::uint32_t least,
                                           std::uint64_t total);

/// Adds the passes that scale sums as if every pixel had `wanted` samples. Squares then give the variance of the mean.
/// counts: buffer of uint, samples of each block, at least 2. half_sums: doubles per path of Accumulated::halves.
void add_adaptive_mean(graph::Graph& graph, const Band& band, const Accumulated& sums, graph::BufferHandle counts,
                       std::uint32_t wanted, std::size_t half_sums);

}  // namespace halflight
