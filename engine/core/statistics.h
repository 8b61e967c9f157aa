// Running moments and the quantiles that tests and reports need.
#pragma once

#include <cstdint>
#include <vector>

namespace halflight {

/// Mean and variance of a stream of values (Welford 1962), in double.
class RunningMoments {
  public:
    void add(double value);
    std::uint64_t count() const { return count_; }
    double mean() const { return mean_; }
    double variance() const;        ///< Unbiased sample variance; 0 below two values.
    double standard_error() const;  ///< Of the mean; 0 below two values.

  private:
    std::uint64_t count_ = 0;
    double mean_ = 0;
    double sum_of_squares_ = 0;  // of deviations from the mean
};

/// Linear-interpolated quantile, q in [0, 1]. Takes a copy because it sorts. Precondition: not empty.
double quantile(std::vector<double> values, double q);
inline double median(std::vector<double> values) {
    return quantile(std::move(values), 0.5);
}

}  // namespace halflight
