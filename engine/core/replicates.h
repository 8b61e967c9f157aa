// Error estimate of a picture that is the mean of independent replicates, from the differences of the replicates.
#pragma once

#include <span>
#include <vector>

#include "engine/core/statistics.h"

namespace halflight {

/// Squared error of a picture: the mean over its values of each value's error times its weight.
struct ErrorEstimate {
    double value = 0;
    double lower = 0;  // lower to upper: confidence interval of this picture's error
    double upper = 0;
    double bound = 0;  // upper bound of the error at the same confidence
};

class ReplicateError {
  public:
    /// Needs at least four replicates; fewer give no error bar for the estimate.
    explicit ReplicateError(int replicates);

    /// Adds one value of the picture: its value in each replicate, and the weight of its error. Replicates are
    /// independent, unbiased and identically distributed; the picture is their mean.
    void add(std::span<const double> values, double weight);
    /// Adds another part of the same picture. Its replicates share their seeds with the present ones, and may have
    /// other numbers of samples.
    void add(const ReplicateError& part);

    /// Returns the estimate, whose interval and bound have the given confidence. Precondition: values have been added.
    ErrorEstimate estimate(double confidence = kConfidence) const;

  private:
    double at(std::size_t r, std::size_t s) const { return gram_[r * replicates_ + s]; }

    std::size_t replicates_;
    std::vector<double> gram_;  // weighted products of the replicates' deviations from their mean, summed over values
    std::vector<double> deviations_;
    double count_ = 0;  // number of values
};

}  // namespace halflight
