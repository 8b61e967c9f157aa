#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <random>

#include "engine/core/error.h"
#include "engine/core/math.h"
#include "engine/core/statistics.h"

namespace halflight {
namespace {

// C++ and shaders share this arithmetic. (1 + 2^-12)^2 rounds to 1 + 2^-11, where a fused operation keeps the 2^-24.
TEST(Arithmetic, ProductsAreRoundedBeforeTheyAreAdded) {
    volatile float factor = 1 + 0x1p-12f, term = -(1 + 0x1p-11f);
    const float a = factor, b = term;
    EXPECT_EQ(a * a + b, 0.0f);
    volatile double wide_factor = 1 + 0x1p-27, wide_term = -(1 + 0x1p-26);
    const double c = wide_factor, d = wide_term;
    EXPECT_EQ(c * c + d, 0.0);
}

TEST(Arithmetic, TheFirstByteIsTheLowest) {
    EXPECT_TRUE(std::endian::native == std::endian::little);
}

TEST(RunningMoments, KeepsVarianceBesideALargeMean) {
    RunningMoments m;
    for (int i = 0; i < 1000; ++i) m.add(1e9 + (i % 2));
    EXPECT_DOUBLE_EQ(m.mean(), 1e9 + 0.5);
    EXPECT_NEAR(m.variance(), 0.25 * 1000 / 999, 1e-9);
}

TEST(Quantile, Interpolates) {
    EXPECT_DOUBLE_EQ(median({3, 1, 2}), 2);
    EXPECT_DOUBLE_EQ(quantile({0, 10}, 0.25), 2.5);
}

TEST(Student, TailsAndQuantilesAgreeWithTables) {
    const struct {
        double t, freedom, tails, tolerance;
    } cases[] = {{0, 7, 1, 1e-9},
                 {1, 1, 0.5, 1e-9},  // Cauchy distribution
                 {3, 1, 1 - 2 / kPi * std::atan(3.0), 1e-9},
                 {std::sqrt(2.0), 2, 1 - std::sqrt(0.5), 1e-9},  // 1 - t / sqrt(2 + t^2)
                 {2.364624, 7, 0.05, 1e-6},
                 {2.976843, 14, 0.01, 1e-6},
                 {1.983972, 100, 0.05, 1e-6}};
    for (const auto& [t, freedom, tails, tolerance] : cases) {
        EXPECT_NEAR(student_tails(t, freedom), tails, tolerance);
        if (t > 0) {
            EXPECT_NEAR(student_quantile(1 - tails, freedom), t, 1e-5);
        }
    }
    EXPECT_LT(student_tails(40, 14), 1e-14);
    EXPECT_NEAR(student_quantile(0.95, 1e9), kNormalQuantile, 3e-3);
}

TEST(Intervals, OfMeanAndJackknifeAreTheSameForAMean) {
    const std::vector<double> values{1, 2, 3, 6};
    std::vector<double> without;
    for (const double v : values) without.push_back((12 - v) / 3);
    const Interval mean = mean_interval(values), jackknife = jackknife_interval(3, without);
    EXPECT_DOUBLE_EQ(mean.value, 3);
    EXPECT_NEAR(mean.half_width, 3.182446 * std::sqrt(14.0 / 3 / 4), 1e-5);
    EXPECT_NEAR(jackknife.half_width, mean.half_width, 1e-12);
    EXPECT_TRUE(std::isinf(mean_interval(std::vector<double>{1}).half_width));
    EXPECT_TRUE(mean.holds(6.4) && !mean.holds(6.5) && !mean.holds(-0.5));
}

TEST(Slope, OfAPowerLawIsItsExponent) {
    std::vector<CurvePoint> points;
    for (const double x : {1.0, 2.0, 4.0, 32.0}) points.push_back({x, 5 / x, 0.1 / x});
    const Slope fit = fit_slope(points);
    EXPECT_NEAR(fit.slope.value, -1, 1e-12);
    EXPECT_NEAR(fit.scatter, 0, 1e-12);
    // All errors are 2 %. The half width follows from the spread of log x about its mean: -2, -1, 0 and 3 times log
    // 2.
    EXPECT_NEAR(fit.slope.half_width, 4.302653 * 0.02 / (std::log(2.0) * std::sqrt(14.0)), 1e-5);
    points.push_back({64, 0, 1});  // an error of 0 has no logarithm
    EXPECT_EQ(fit_slope(points).points, 4);
    points.push_back({1e6, 1, 1e6});  // this point has almost no weight
    EXPECT_NEAR(fit_slope(points).slope.value, -1, 1e-3);
    EXPECT_TRUE(std::isinf(fit_slope(std::vector<CurvePoint>{{1, 1, 0.1}}).slope.half_width));
    EXPECT_TRUE(std::isinf(fit_slope(std::vector<CurvePoint>{{1, 1, 0.1}, {1, 2, 0.1}}).slope.half_width));
}

TEST(Slope, IntervalContainsTheTruth) {
    std::mt19937 generator(1);
    std::normal_distribution<double> normal;
    constexpr int kTrials = 1000;                  // shows a share that is wrong by 5 % in 99 % of all runs
    for (const double error_scale : {1.0, 0.1}) {  // correct error bars, and ones that are far too small
        int held = 0;
        for (int trial = 0; trial < kTrials; ++trial) {
            std::vector<CurvePoint> points;
            for (double x = 1; x < 100; x *= 2) {
                const double y = 3 * std::pow(x, -0.8);
                points.push_back({x, y * (1 + 0.03 * normal(generator)), 0.03 * y * error_scale});
            }
            held += fit_slope(points).slope.holds(-0.8);
        }
        EXPECT_GT(held, 0.929 * kTrials);                              // three standard errors of 95 % are 2.1 %
        EXPECT_LT(held, (error_scale < 1 ? 0.971 : 0.995) * kTrials);  // given errors never narrow the interval
    }
}

TEST(Error, IsOneLine) {
    EXPECT_STREQ(Error("a.gltf", "bad\nthing {}", 3).what(), "a.gltf: bad thing 3");
    EXPECT_STREQ(Error("a.gltf", "bad \x1b[31mthing\x7f").what(), "a.gltf: bad ?[31mthing?");
}

}  // namespace
}  // namespace halflight
