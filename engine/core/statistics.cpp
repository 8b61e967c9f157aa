#include "engine/core/statistics.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <numbers>

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

// Integrates over the angle in t = sqrt(freedom) tan(angle), where the density is C cos(angle)^(freedom - 1). Simpson's
// rule on 256 intervals up to pi/2 gives at least 5 digits at 1000 degrees of freedom, and more at fewer.
double student_tails(double t, double freedom) {
    constexpr int kIntervals = 256;
    freedom = std::min(freedom, 1000.0);
    const double from = std::atan(t / std::sqrt(freedom)), step = (std::numbers::pi / 2 - from) / kIntervals;
    double sum = 0;
    for (int i = 0; i <= kIntervals; ++i) {
        const double weight = i == 0 || i == kIntervals ? 1 : i % 2 == 1 ? 4 : 2;
        sum += weight * std::pow(std::cos(from + i * step), freedom - 1);
    }
    const double constant =
        std::exp(std::lgamma((freedom + 1) / 2) - std::lgamma(freedom / 2)) / std::sqrt(std::numbers::pi);
    return std::min(2 * constant * sum * step / 3, 1.0);
}

// Bisects the angle of student_tails(), over which the tail probability falls strictly from 1 to 0.
double student_quantile(double chance, double freedom) {
    assert(chance > 0 && chance < 1 && freedom >= 1);
    double low = 0, high = std::numbers::pi / 2;
    for (int bit = 0; bit < std::numeric_limits<double>::digits; ++bit) {
        const double angle = (low + high) / 2;
        const double tails = student_tails(std::sqrt(freedom) * std::tan(angle), freedom);
        (tails > 1 - chance ? low : high) = angle;
    }
    return std::sqrt(freedom) * std::tan(low);
}

Interval mean_interval(std::span<const double> values) {
    RunningMoments moments;
    for (const double v : values) moments.add(v);
    if (values.size() < 2) return {moments.mean(), std::numeric_limits<double>::infinity()};
    const double t = student_quantile(kConfidence, static_cast<double>(values.size() - 1));
    return {moments.mean(), t * moments.standard_error()};
}

Interval jackknife_interval(double value, std::span<const double> without_one) {
    if (without_one.size() < 2) return {value, std::numeric_limits<double>::infinity()};
    RunningMoments moments;
    for (const double v : without_one) moments.add(v);
    const auto n = static_cast<double>(without_one.size());
    // The jackknife variance is (n - 1) / n times the sum of squared deviations.
    const double variance = (n - 1) * (n - 1) / n * moments.variance();
    return {value, student_quantile(kConfidence, n - 1) * std::sqrt(variance)};
}

Slope fit_slope(std::span<const CurvePoint> points) {
    bool weighted = true;
    for (const CurvePoint& p : points) weighted = weighted && !(p.y > 0 && p.error == 0);
    struct Term {
        double x, y, weight;
    };
    std::vector<Term> terms;
    double sum = 0, x = 0, y = 0;
    for (const CurvePoint& p : points) {
        if (!(p.y > 0)) continue;
        const Term& t =
            terms.emplace_back(Term{std::log(p.x), std::log(p.y), weighted ? std::pow(p.y / p.error, 2) : 1.0});
        sum += t.weight, x += t.weight * t.x, y += t.weight * t.y;
    }
    Slope fit;
    fit.points = static_cast<int>(terms.size());
    fit.slope.half_width = std::numeric_limits<double>::infinity();
    x /= sum, y /= sum;
    double xx = 0, xy = 0;
    for (const Term& t : terms) {
        xx += t.weight * (t.x - x) * (t.x - x);
        xy += t.weight * (t.x - x) * (t.y - y);
    }
    if (!(xx > 0)) return fit;
    fit.slope.value = xy / xx;
    double chi_square = 0;
    for (const Term& t : terms) chi_square += t.weight * std::pow(t.y - y - fit.slope.value * (t.x - x), 2);
    const double freedom = fit.points - 2;
    if (freedom > 0) {
        fit.scatter = chi_square / freedom;
        const double widening = weighted ? std::max(fit.scatter, 1.0) : fit.scatter;
        fit.slope.half_width = student_quantile(kConfidence, freedom) * std::sqrt(widening / xx);
    } else if (weighted) {  // two points have no residuals, so their errors are trusted
        fit.slope.half_width = kNormalQuantile / std::sqrt(xx);
    }
    return fit;
}

}  // namespace halflight
