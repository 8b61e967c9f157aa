#include "engine/core/replicates.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace halflight {

// Let d_r be the error of replicate r, a vector over all values. <.,.> is the mean weighted product, R is the number of
// replicates, and d is the mean of the d_r. The scatter of the replicates
//   V = sum_r |d_r - d|^2 / (R (R - 1))
// has the squared error |d|^2 of their mean as its expected value, whatever correlates the samples within a replicate.
// Its deviation is
//   |d|^2 - V = sum_{r != s} <d_r, d_s> / (R (R - 1)),
// with mean 0 and variance 2 / (R (R - 1)) E<d_1, d_2>^2, whatever correlates pixels. For four different replicates,
//   <d_p - d_q, d_r - d_s>^2 has the mean 4 E<d_1, d_2>^2,
// since its mixed products have mean 0. It needs the differences of the d_r only, not the d_r themselves. It is a
// quadratic form of rank R (R - 3) / 2; this number of independent products is the freedom of Student's t.
//
// Both V and |d|^2 are sums of squares, whose distributions are skewed. The logarithm of their ratio is more nearly
// normal, and has the deviation of |d|^2 - V divided by V (delta method).
//
// Student's t assumes that <d_1, d_2> is nearly normal, like a sum of independent noise over many pixels. If few
// values hold most of the error, the coverage of the interval is lower. A feature that no sample of any replicate has
// met, such as a small bright light, is in none of the differences, and therefore not in V either.

ReplicateError::ReplicateError(int replicates)
    : replicates_(static_cast<std::size_t>(replicates)), gram_(replicates_ * replicates_), deviations_(replicates_) {
    assert(replicates >= 4);
}

void ReplicateError::add(std::span<const double> values, double weight) {
    assert(values.size() == replicates_);
    double mean = 0;
    for (const double v : values) mean += v / static_cast<double>(replicates_);
    for (std::size_t r = 0; r < replicates_; ++r) deviations_[r] = values[r] - mean;
    for (std::size_t r = 0; r < replicates_; ++r)
        for (std::size_t s = 0; s < replicates_; ++s)
            gram_[r * replicates_ + s] += weight * deviations_[r] * deviations_[s];
    count_ += 1;
}

void ReplicateError::add(const ReplicateError& part) {
    assert(part.replicates_ == replicates_);
    std::ranges::transform(gram_, part.gram_, gram_.begin(), std::plus<>());
    count_ += part.count_;
}

ErrorEstimate ReplicateError::estimate(double confidence) const {
    assert(count_ > 0);
    const auto n = static_cast<double>(replicates_);
    double scatter = 0;
    RunningMoments products;  // moments of the products of four different replicates
    for (std::size_t p = 0; p < replicates_; ++p) {
        scatter += at(p, p);
        for (std::size_t q = 0; q < p; ++q) {
            for (std::size_t r = 0; r < p; ++r) {
                for (std::size_t s = 0; s < r; ++s) {
                    if (r == q || s == q) continue;
                    products.add(std::pow(at(p, r) - at(p, s) - at(q, r) + at(q, s), 2));
                }
            }
        }
    }
    const double value = scatter / (n * (n - 1) * count_);
    const double deviation = std::sqrt(2 / (n * (n - 1)) * products.mean() / 4) / count_;
    const double freedom = n * (n - 3) / 2;
    const double spread = value > 0 ? deviation / value : 0;  // deviation of the logarithm
    const double two_sided = std::exp(student_quantile(confidence, freedom) * spread);
    // half of the tail probability is below the interval
    const double one_sided = std::exp(student_quantile(2 * confidence - 1, freedom) * spread);
    return {value, value / two_sided, value * two_sided, value * one_sided};
}

}  // namespace halflight
