// Pictures of independent seeds: their mean, and the scatter of single pictures.
#pragma once

#include "engine/core/image.h"
#include "tests/support/image_tests.h"

namespace halflight::test {

/// Returns the means over whole blocks of `side` pixels, of three channels. The scatter of the blocks gives their
/// errors even where pixels are correlated: all pixels of a sample use the same point of the pixel, and pixels share
/// paths.
Image block_means(const Image& image, int side);

/// Mean over independent batches of samples, and the scatter of the batches. The variance is that of one batch,
/// whatever correlates its samples.
class Batches {
  public:
    void add(const Image& image);
    const Image& mean() const { return mean_; }
    /// Returns the estimate of two or more batches; it refers to this object.
    Estimate estimate();
    /// Returns the mean over all values of a batch's variance.
    double variance() const;

  private:
    int count_ = 0;
    Image mean_, squares_, variance_;
};

}  // namespace halflight::test
