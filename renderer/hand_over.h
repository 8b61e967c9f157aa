// Transition from the biased samples that use the radiance cache to the unbiased samples: weights of both.
#pragma once

#include <array>
#include <optional>

#include "passes/picture/accumulate.h"
#include "renderer/frame_constants.h"

namespace halflight {

/// Number of cached samples: the first samples of a picture, which use the radiance cache. Each is worth several
/// unbiased samples, so these few suffice until unbiased samples take over without a bump in the error.
inline constexpr int kCachedSamples = 4;
/// Number of samples, including the cached ones, from which on the picture is bit for bit the mean of the unbiased
/// samples alone.
inline constexpr int kHandedOver = 32;

/// Returns the weight of the mean of the cached samples in a picture of `samples` samples, including the cached ones.
/// It is 1 without unbiased samples and 0 from kHandedOver on. In between it is (1 - x)/(1 + x), where x is the share
/// of the unbiased samples rendered so far. At first this is inverse variance weighting as if the cached samples were
/// worth half of kHandedOver. Later the unbiased samples make up for the lost weight.
double cached_weight(int samples);

/// Returns cached sample `index` of a picture. Its random numbers are independent of those of sample_view(). All cached
/// samples belong to one sequence, of which earlier pictures used the first `first`.
SampleView cached_view(const FrameSettings& frame, const Band& band, std::uint32_t first, std::uint32_t index,
                       SamplePoints points);

/// Sums of a band (Accumulated), in the history of the executor of its graph; null if the frame left them out.
struct SumBuffers {
    gpu::Buffer *emission = nullptr, *direct = nullptr, *indirect = nullptr, *squares = nullptr, *features = nullptr,
                *halves = nullptr, *groups = nullptr, *catchers = nullptr;
    int first_half = 0;  // number of samples of the first half

    std::array<gpu::Buffer*, 8> all() const {
        return {emission, direct, indirect, squares, features, halves, groups, catchers};
    }
};

/// Returns the sums as resources of a graph.
Accumulated imported(graph::Graph& graph, const SumBuffers& sums);

/// Sums of a band's first samples, whose mean is the picture.
struct ShownSums {
    SumBuffers sums;
    int samples = 0;   // number of samples in the sums
    int mattes = 0;    // number of samples in the mattes, which hold only the last kind of sample
    double first = 0;  // number of samples of the first half; if kinds of samples are blended, by their weights
};

/// Blends the sums of cached and unbiased samples. Owns the blended buffers.
class HandOver {
  public:
    /// Returns the sums of the first `done` samples of a band, blended if there are both kinds. They are valid until
    /// the next call. cached: sums of the first kCachedSamples samples. Null: all samples are in `others`.
    ShownSums shown(graph::Executor& executor, const SumBuffers* cached, const SumBuffers& others, int done);

  private:
    /// Returns sums that, divided by cached_samples + samples, give the weighted means, and squares that give the
    /// variance of the weighted means.
    SumBuffers blend(graph::Executor& executor, const SumBuffers& cached, int cached_samples, const SumBuffers& others,
                     int samples);

    std::array<std::optional<gpu::Buffer>, 7> blended_;
};

}  // namespace halflight
