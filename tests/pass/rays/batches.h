// Averages pictures of independent seeds, and measures the scatter of single pictures.
#pragma once

#include "engine/core/image.h"
#include "tests/support/image_tests.h"

namespace halflight::test {

/// Returns the means of three channels over whole blocks of `side` pixels. The scatter of the blocks gives their
/// errors even if pixels are correlated. All pixels of a sample use the same point of the pixel, and pixels share
/// paths.
Image block_means(const Image& image, int side);

/// Sums independent batches of samples for their mean and scatter. The variance is that of one batch, so it includes
/// any correlation of its samples.
class Batches {
  public:
    void add(const Image& image);
    const Image& mean() const { return mean_; }
    /// Returns the estimate of two or more batches. The estimate refers to this object.
    Estimate estimate();
    /// Returns the variance of a batch, averaged over all values.
    double variance() const;

  private:
    int count_ = 0;
    Image mean_, squares_, variance_;
};

}  // namespace halflight::test
