// Running moments, quantiles and intervals that tests and reports need.
#pragma once

#include <cstdint>
#include <span>
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

/// Chance that |t| is greater than `t` >= 0, for Student's t of `freedom` >= 1 degrees; more than 1000 count as 1000,
/// which is a thousandth from the normal distribution.
double student_tails(double t, double freedom);
/// The t that |t| does not exceed with this chance, in (0, 1): 12.7, 2.36, 1.98 at 95 % for 1, 7, 100 degrees.
double student_quantile(double chance, double freedom);

/// All intervals of reports hold what they are about with this chance.
inline constexpr double kConfidence = 0.95;
inline constexpr double kNormalQuantile = 1.959964;  ///< what |z| does not exceed with this chance, z standard normal

/// value +- half_width, at kConfidence; without spread to tell it from, half_width is infinite.
struct Interval {
    double value = 0;
    double half_width = 0;  // >= 0

    double lower() const { return value - half_width; }
    double upper() const { return value + half_width; }
    bool holds(double v) const { return lower() <= v && v <= upper(); }
};
/// Of the mean of independent, about normal values (Student 1908); infinite below two.
Interval mean_interval(std::span<const double> values);
/// Of a statistic that has this value for all of a sample and these ones where each member in turn is left out, by the
/// jackknife (Tukey 1958; Efron, Stein 1981: its variance errs upwards).
Interval jackknife_interval(double value, std::span<const double> without_one);

/// A point of a curve y(x) on double logarithmic axes.
struct CurvePoint {
    double x = 0;      // > 0
    double y = 0;      // points of y <= 0 have no logarithm and take no part
    double error = 0;  // standard error of y, >= 0
};
struct Slope {
    Interval slope;      // d log y / d log x; half_width is infinite where nothing tells it
    double scatter = 0;  // chi-square of the fit by its degrees of freedom; 0 for two points
    int points = 0;      // that took part
};
/// The line through log y by least squares, weighted by log y's variance (error / y)^2; where any point is without
/// error, all weigh alike. Points that scatter about the line by more than their errors say widen the interval by as
/// much (Birge 1932). Points that share their samples are not independent: the interval is then too narrow.
Slope fit_slope(std::span<const CurvePoint> points);

}  // namespace halflight
