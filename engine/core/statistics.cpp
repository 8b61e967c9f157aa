#include "engine/core/statistics.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace halflight {

void RunningMoments::add(double value) {
    ++count_;
    const double delta = value - mean_;
    mean_ += delta / static_cast<double>(count_);
    sum_of_squares_ += delta * (value - mean_);
}

double RunningMoments::variance() const {
    return count_ < 2 ? 0.0 : sum_of_squares_ / static_cast<double>(count_ - 1);
}

double RunningMoments::standard_error() const {
    return count_ < 2 ? 0.0 : std::sqrt(variance() / static_cast<double>(count_));
}

double quantile(std::vector<double> values, double q) {
    assert(!values.empty() && q >= 0 && q <= 1);
    std::sort(values.begin(), values.end());
    const double position = q * static_cast<double>(values.size() - 1);
    const auto below = static_cast<std::size_t>(position);
    const std::size_t above = std::min(below + 1, values.size() - 1);
    return std::lerp(values[below], values[above], position - static_cast<double>(below));
}

}  // namespace halflight
