// Pictures of independent seeds: their mean, and how much single ones scatter around it.
#pragma once

#include "engine/core/image.h"
#include "tests/support/image_tests.h"

namespace halflight::test {

/// Means over whole blocks of `side` pixels, of three channels. Their scatter tells their errors, whatever pixels have
/// in common: the engine's samples look through the same point of every pixel, and pixels share paths.
Image block_means(const Image& image, int side);

/// Means over batches that share nothing, and how much single batches scatter around them: the variance is that of a
/// batch, whatever its samples have in common.
class Batches {
  public:
    void add(const Image& image);
    const Image& mean() const { return mean_; }
    /// Of two batches or more. Refers to this object.
    Estimate estimate();
    /// Mean over all values of a batch's variance.
    double variance() const;

  private:
    int count_ = 0;
    Image mean_, squares_, variance_;
};

}  // namespace halflight::test
