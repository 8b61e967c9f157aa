// Tests the estimate of a picture's error from two noisy pictures.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "engine/core/metrics.h"
#include "renderer/held_out.h"

namespace halflight {
namespace {

constexpr int kSide = 64;

/// Pictures of a truth of 0.5: one with errors of +-`error` by columns, two with independent noise. Noise is equal
/// within blocks of `block` x `block` pixels and in all channels. rare: noise is `rare` times rarer and larger.
struct Pictures {
    Pictures(double error, double noise, int block, std::uint32_t seed, double rare = 1) {
        std::mt19937 random(seed);
        std::normal_distribution<double> normal(0, noise);
        std::bernoulli_distribution chosen(1 / rare);
        for (Image* image : {&first, &second})
            for (int y = 0; y < kSide; y += block)
                for (int x = 0; x < kSide; x += block) {
                    const double n = normal(random) * (chosen(random) ? std::sqrt(rare) : 0);
                    for (int i = 0; i < block * block; ++i)
                        for (int c = 0; c < 3; ++c)
                            image->at(x + i % block, y + i / block)[c] = static_cast<float>(0.5 + n);
                }
        for (int i = 0; i < kSide * kSide; ++i)
            for (int c = 0; c < 3; ++c)
                picture.at(i % kSide, i / kSide)[c] = static_cast<float>(0.5 + (i % 2 ? error : -error));
    }
    Image picture{kSide, kSide, 4}, first{kSide, kSide, 4}, second{kSide, kSide, 3};
};

TEST(HeldOutError, IsExactWithoutNoise) {
    const Pictures p(0.1, 0, 1, 0);
    const ErrorEstimate squared = held_out_error(p.picture, p.first, p.second, ErrorMetric::mse);
    EXPECT_NEAR(squared.value, 0.01, 1e-7);
    EXPECT_NEAR(squared.upper, squared.value, 1e-9);
    const ErrorEstimate relative = held_out_error(p.picture, p.first, p.second, ErrorMetric::relmse);
    // Columns alternate. A dark one lies between two bright ones; at the border it counts twice.
    const double dark = 0.4 * 0.4, bright = 0.6 * 0.6, inner = kSide - 2;
    const auto part = [](double square) { return 0.01 / (square + kRelativeEpsilon); };
    const double expected = (inner / 2 * (part((3 * dark + 6 * bright) / 9) + part((6 * dark + 3 * bright) / 9)) +
                             part((6 * dark + 3 * bright) / 9) + part((3 * dark + 6 * bright) / 9)) /
                            kSide;
    EXPECT_NEAR(relative.value, expected, 1e-6);
}

// The noise of both pictures is much larger than the error that they measure.
TEST(HeldOutError, CoversTheTruth) {
    constexpr int kSeeds = 400;
    for (const int block : {1, 4, 16}) {
        for (const double rare : {1.0, 20.0}) {
            if (block == 16 && rare > 1) continue;  // few of 16 blocks would have noise
            int inside = 0, below = 0;
            double sum = 0, squares = 0;
            for (std::uint32_t seed = 0; seed < kSeeds; ++seed) {
                const Pictures p(0.05, 0.4 / block, block, seed, rare);
                const ErrorEstimate e = held_out_error(p.picture, p.first, p.second, ErrorMetric::mse);
                EXPECT_TRUE(0 <= e.lower && e.lower <= e.upper && e.value < e.bound && e.bound <= e.upper);
                inside += e.lower <= 0.0025 && 0.0025 <= e.upper;
                below += 0.0025 <= e.bound;
                sum += e.value, squares += e.value * e.value;
            }
            const double mean = sum / kSeeds, error = std::sqrt((squares / kSeeds - mean * mean) / kSeeds);
            EXPECT_NEAR(mean, 0.0025, 4 * error) << block << " " << rare;
            // 95 % of 400 are 380 +- 4.4.
            EXPECT_GE(inside, 367) << block << " " << rare;
            EXPECT_GE(below, 362) << block << " " << rare;
            if (rare > 1) continue;  // heavy tails widen the interval
            EXPECT_LE(below, 396) << block;
        }
    }
}

}  // namespace
}  // namespace halflight
