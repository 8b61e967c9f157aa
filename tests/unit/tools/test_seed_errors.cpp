// Tests error estimates from noisy renders and a noisy reference against known bias and variance.
#include "tools/measure/common/seed_errors.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "engine/core/metrics.h"

namespace halflight {
namespace {

/// Pictures with the true value 1 + c / 2 in channel c. The channels share their noise, which is Gaussian or
/// heavy-tailed with equal variance. One of every `apart` pixels has all the noise.
class Pictures {
  public:
    explicit Pictures(std::uint32_t seed, bool heavy = false, int apart = 1)
        : generator_(seed), heavy_(heavy), apart_(apart) {}

    Image make(double bias, double deviation) {
        Image image(32, 32, 3);
        for (int y = 0; y < 32; ++y) {
            for (int x = 0; x < 32; ++x) {
                const double noise = x % apart_ == 0 ? deviation * std::sqrt(apart_) * draw() : 0;
                for (int c = 0; c < 3; ++c) image.at(x, y)[c] = static_cast<float>(1 + 0.5 * c + bias + noise);
            }
        }
        return image;
    }
    std::vector<Image> renders(int count, double bias, double deviation) {
        std::vector<Image> images;
        for (int i = 0; i < count; ++i) images.push_back(make(bias, deviation));
        return images;
    }

  private:
    /// Returns noise of mean 0 and variance 1. If it is heavy-tailed, one of 64 values is 8 standard deviations.
    double draw() {
        if (!heavy_) return normal_(generator_);
        return (generator_() % 64 == 0 ? 8 - 1 / 8.0 : -1 / 8.0) / std::sqrt(63.0 / 64);
    }

    std::mt19937 generator_;
    std::normal_distribution<double> normal_;
    bool heavy_;
    int apart_;
};

TEST(SeedErrors, AreExactForOffsets) {
    Pictures pictures(1);
    const std::vector<Image> renders = pictures.renders(4, 0.5, 0);
    const Image reference = pictures.make(0, 0);
    const SeedErrors errors = seed_errors(renders, reference, reference);
    EXPECT_NEAR(errors.mse.value, 0.25, 1e-6);
    EXPECT_NEAR(errors.squared_bias.value, 0.25, 1e-6);
    EXPECT_NEAR(errors.variance.value, 0, 1e-9);
    EXPECT_NEAR(errors.mse.half_width, 0, 1e-9);
    EXPECT_EQ(errors.reference_variance, 0);
    const SeedErrors relative = seed_errors(renders, reference, reference, relative_weights(reference));
    EXPECT_NEAR(relative.mse.value, (1 / 1.01 + 1 / 2.26 + 1 / 4.01) / 3 * 0.25, 1e-6);
    EXPECT_NEAR(relative.mse.value, mean_of(relative_squared_error_map(renders[0], reference)), 1e-6);
}

TEST(SeedErrors, MseIsTheSumOfBiasAndVariance) {
    Pictures pictures(2);
    const std::vector<Image> renders = pictures.renders(5, 0.1, 0.2);
    const SeedErrors errors = seed_errors(renders, pictures.make(0, 0.3), pictures.make(0, 0.3));
    EXPECT_NEAR(errors.mse.value, errors.squared_bias.value + errors.variance.value, 1e-12);
    EXPECT_EQ(errors.of_render.size(), 5u);
    EXPECT_NEAR(errors.reference_variance, 0.09 / 2, 0.006);  // the standard error of 1024 pixels is 4.4 %
}

TEST(SeedErrors, OneRenderHasAnErrorButNoInterval) {
    Pictures pictures(3);
    const SeedErrors errors = seed_errors(pictures.renders(1, 0, 0.2), pictures.make(0, 0.1), pictures.make(0, 0.1));
    EXPECT_NEAR(errors.mse.value, 0.04, 0.01);
    for (const Interval& interval : {errors.mse, errors.squared_bias, errors.variance})
        EXPECT_TRUE(std::isinf(interval.half_width));
}

/// Counts how often the intervals of many experiments contain the truth, and sums the estimates.
struct Tally {
    int trials = 0, mse = 0, bias = 0, variance = 0;
    RunningMoments mean_mse, mean_bias, mean_variance;

    void add(const SeedErrors& e, double true_bias, double true_variance) {
        ++trials;
        mse += e.mse.holds(true_bias + true_variance);
        bias += e.squared_bias.holds(true_bias);
        variance += e.variance.holds(true_variance);
        mean_mse.add(e.mse.value), mean_bias.add(e.squared_bias.value), mean_variance.add(e.variance.value);
    }
};

TEST(SeedErrors, AreUnbiasedAndIntervalsHaveTheirCoverage) {
    struct Case {
        double bias, noise, reference_noise;
        bool heavy = false;
        int apart = 1;
    };
    constexpr int kTrials = 300;
    for (const Case& c : {Case{0, 0.2, 0.2}, Case{0.05, 0.2, 0.1}, Case{0.05, 0.1, 0.4}, Case{0, 0.1, 0.5},
                          Case{0, 0.2, 0.1, true}, Case{0, 0.1, 0.5, false, 4}, Case{0.05, 0.1, 0.4, false, 4}}) {
        Tally tally;
        for (std::uint32_t trial = 0; trial < kTrials; ++trial) {
            Pictures pictures(1000 + trial, c.heavy, c.apart);
            const std::vector<Image> renders = pictures.renders(6, c.bias, c.noise);
            const Image first = pictures.make(0, c.reference_noise), second = pictures.make(0, c.reference_noise);
            tally.add(seed_errors(renders, first, second), c.bias * c.bias, c.noise * c.noise);
        }
        const auto near = [&](const RunningMoments& m, double truth) {
            EXPECT_NEAR(m.mean(), truth, 4 * m.standard_error())
                << c.bias << ' ' << c.noise << ' ' << c.reference_noise;
        };
        near(tally.mean_mse, c.bias * c.bias + c.noise * c.noise);
        near(tally.mean_bias, c.bias * c.bias);
        near(tally.mean_variance, c.noise * c.noise);
        // The bound is 95 % minus three standard errors of a share of 300; the jackknife may be conservative.
        for (const int held : {tally.mse, tally.bias, tally.variance}) EXPECT_GE(held, 0.91 * kTrials) << c.bias;
        EXPECT_LE(tally.variance, 0.99 * kTrials);
        EXPECT_LE(tally.mse, 0.995 * kTrials);
    }
}

}  // namespace
}  // namespace halflight
