// How wrong a picture is that is the mean of independent replicates of itself, told from how they differ.
#pragma once

#include <span>
#include <vector>

namespace halflight {

/// A picture's squared error, mean over its values, each times its weight.
struct ErrorEstimate {
    double value = 0;
    double lower = 0;  // lower to upper holds the error of this very picture at kConfidence
    double upper = 0;
    double bound = 0;  // the error is below it at kConfidence
};

class ReplicateError {
  public:
    /// At least four: fewer do not tell how far the estimate is off.
    explicit ReplicateError(int replicates);

    /// A value of the picture: what each replicate has for it, and the weight of its error. Replicates are independent,
    /// unbiased and alike; the picture is their mean.
    void add(std::span<const double> values, double weight);
    /// Another part of the same picture: its replicates share seeds with these, and may have other numbers of samples.
    void add(const ReplicateError& part);

    /// Precondition: not empty.
    ErrorEstimate estimate() const;

  private:
    double at(std::size_t r, std::size_t s) const { return gram_[r * replicates_ + s]; }

    std::size_t replicates_;
    std::vector<double> gram_;  // weighted products of the replicates' deviations from their mean, summed over values
    std::vector<double> deviations_;
    double count_ = 0;  // of values
};

}  // namespace halflight
