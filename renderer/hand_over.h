// From the samples that use the radiance cache to the unbiased ones: which have how much weight while samples come.
#pragma once

#include <array>
#include <optional>

#include "passes/picture/accumulate.h"
#include "renderer/frame_constants.h"

namespace halflight {

/// Samples of a picture that use the radiance cache: its first ones. They are worth several times as many others, so
/// that as few do until these have come, without a bump in the error.
inline constexpr int kCachedSamples = 4;
/// Samples of a picture, cached ones included, from which on it is the mean of the others alone, bit for bit.
inline constexpr int kHandedOver = 32;

/// Weight of the mean of the cached samples in a picture of so many samples, cached ones included: 1 while there are no
/// others, 0 from kHandedOver on. With x the share of the others that has come till then it is (1 - x)/(1 + x): at
/// first as by inverse variance, were the cached samples worth half of kHandedOver; later the others make up for what
/// is taken away.
double cached_weight(int samples);

/// Cached sample number `index` of a picture. Its numbers have nothing in common with those of sample_view(). `first`:
/// how many the cache has been brought by earlier pictures; they all are of one sequence.
SampleView cached_view(const FrameSettings& frame, const Band& band, std::uint32_t first, std::uint32_t index,
                       SamplePoints points);

/// Sums of a band (Accumulated), in the history of who runs its graph; null where the frame left them out.
struct SumBuffers {
    gpu::Buffer *emission = nullptr, *direct = nullptr, *indirect = nullptr, *squares = nullptr, *features = nullptr;
};

/// What the picture of a band's first samples is the mean of.
struct ShownSums {
    SumBuffers sums;
    int samples = 0;  // in them
    int mattes = 0;   // of those, in the mattes: those that the last kind of sample has added
};

class HandOver {
  public:
    /// cached: sums of the first kCachedSamples of `done`, or null where all are in `others`. Those of both are blended
    /// by a graph of its own, and there until the next call.
    ShownSums shown(graph::Executor& executor, const SumBuffers* cached, const SumBuffers& others, int done);

  private:
    /// Sums that are to be divided by cached_samples + samples: their means are the weighted ones, and so is the
    /// variance that their squares tell.
    SumBuffers blend(graph::Executor& executor, const SumBuffers& cached, int cached_samples, const SumBuffers& others,
                     int samples);

    std::array<std::optional<gpu::Buffer>, 5> blended_;
};

}  // namespace halflight
