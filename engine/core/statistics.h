// Running moments, quantiles and confidence intervals of tests and reports.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace halflight {

/// Mean and variance of a stream of values in double precision (Welford 1962).
class RunningMoments {
  public:
    void add(double value);
    std::uint64_t count() const { return count_; }
    double mean() const { return mean_; }
    double variance() const;        ///< Returns the unbiased sample variance; 0 for fewer than two values.
    double standard_error() const;  ///< Returns the standard error of the mean; 0 for fewer than two values.

  private:
    std::uint64_t count_ = 0;
    double mean_ = 0;
    double sum_of_squares_ = 0;  // squared deviations from the mean
};

/// Returns the linearly interpolated quantile, q in [0, 1]. Takes a copy because it sorts. Precondition: not empty.
double quantile(std::vector<double> values, double q);
inline double median(std::vector<double> values) {
    return quantile(std::move(values), 0.5);
}

/// Returns the probability that |t| exceeds `t` >= 0, for Student's t of `freedom` >= 1 degrees of freedom. More than
/// 1000 degrees count as 1000, which differs from the normal distribution by a thousandth.
double student_tails(double t, double freedom);
/// Returns the t that |t| does not exceed with probability `chance` in (0, 1): 12.7, 2.36 and 1.98 at 95 % for 1, 7 and
/// 100 degrees of freedom.
double student_quantile(double chance, double freedom);

/// Confidence of all intervals in reports.
inline constexpr double kConfidence = 0.95;
/// Quantile that a standard normal |z| does not exceed with probability kConfidence.
inline constexpr double kNormalQuantile = 1.959964;

/// Interval value +- half_width at confidence kConfidence. half_width is infinite if too few values give no spread.
struct Interval {
    double value = 0;
    double half_width = 0;  // >= 0

    double lower() const { return value - half_width; }
    double upper() const { return value + half_width; }
    bool holds(double v) const { return lower() <= v && v <= upper(); }
};
/// Returns the interval of the mean of independent, nearly normal values (Student 1908); infinite for fewer than two.
Interval mean_interval(std::span<const double> values);
/// Returns the jackknife interval of a statistic (Tukey 1958). `value` is the statistic of the whole sample;
/// `without_one` holds it for the sample without each member in turn. Its variance is biased upwards (Efron, Stein
/// 1981).
Interval jackknife_interval(double value, std::span<const double> without_one);

/// A point of a curve y(x) on double logarithmic axes.
struct CurvePoint {
    double x = 0;      // > 0
    double y = 0;      // points with y <= 0 have no logarithm and are ignored
    double error = 0;  // standard error of y, >= 0
};
struct Slope {
    Interval slope;      // d log y / d log x; half_width is infinite if the points do not determine it
    double scatter = 0;  // chi-square of the fit per degree of freedom; 0 for two points
    int points = 0;      // number of points used
};
/// Fits a line through log y by least squares, weighted by the variance (error / y)^2 of log y. If any point has no
/// error, all weights are equal. A scatter larger than the errors predict widens the interval accordingly (Birge 1932).
/// The interval is too narrow for points that share samples, because they are not independent.
Slope fit_slope(std::span<const CurvePoint> points);

}  // namespace halflight
