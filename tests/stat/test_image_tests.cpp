// Tests the z-test itself: it accepts pictures that differ only by noise, and rejects all others.
#include "tests/support/image_tests.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <random>

namespace halflight::test {
namespace {

constexpr int kSize = 48, kSamples = 64;

struct Noisy {
    Image mean{kSize, kSize, 3}, variance{kSize, kSize, 3};
    operator Estimate() const { return {mean, variance, kSamples}; }
};

/// Returns uniform noise around a gradient times `scale`; the left eighth is black and has no noise.
Noisy make(unsigned seed, double scale = 1) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> uniform(0, 2);
    Noisy result;
    for (int y = 0; y < kSize; ++y) {
        for (int x = kSize / 8; x < kSize; ++x) {
            for (int c = 0; c < 3; ++c) {
                double sum = 0, squares = 0;
                for (int i = 0; i < kSamples; ++i) {
                    const double value = scale * (0.5 + y) * uniform(random);
                    sum += value, squares += value * value;
                }
                result.mean.at(x, y)[c] = static_cast<float>(sum / kSamples);
                result.variance.at(x, y)[c] = static_cast<float>((squares - sum * sum / kSamples) / (kSamples - 1));
            }
        }
    }
    return result;
}

TEST(ImageTests, AcceptsEqualMeans) {
    const Noisy a = make(1), b = make(2);
    for (const int block : {1, 5, 16}) {
        const ZTest test = compare_means(a, b, block);
        EXPECT_GT(test.p_value, 0.01) << block << ": " << describe(test);
        EXPECT_NEAR(test.above_2, kNormalAbove2, 0.03) << block;
        EXPECT_EQ(test.different, 0u);
        EXPECT_LT(std::abs(test.relative_difference), 3 * test.relative_error);
    }
    EXPECT_EQ(compare_means(a, b).untested, 3u * kSize * kSize / 8);
    EXPECT_TRUE(agree("image-tests-equal", a, b));
}

TEST(ImageTests, RefusesSmallBias) {
    const Noisy a = make(1, 1.02), b = make(2);  // a difference of 2 % is a fifth of a pixel's standard error
    EXPECT_LT(compare_means(a, b, 16).p_value, 1e-4);
    EXPECT_NEAR(compare_means(a, b).relative_difference, 0.02, 3 * compare_means(a, b).relative_error);
    const ::testing::AssertionResult result = agree("image-tests-bias", a, b, {.block = 16});
    ASSERT_FALSE(result);
    // The files that the message names exist.
    const std::string message = result.message();
    const std::size_t end = message.find("-image.ppm"), start = message.rfind(' ', end) + 1;
    const std::string base = message.substr(start, end - start);
    for (const char* suffix : {"-image.ppm", "-reference.ppm", "-z.ppm", "-image.pfm", "-reference.pfm", "-z.pfm"}) {
        EXPECT_GT(std::filesystem::file_size(base + suffix), 20u) << suffix;
        std::filesystem::remove(base + suffix);
    }
}

TEST(ImageTests, RefusesOneWrongPixelAndNaN) {
    const Noisy a = make(1), b = make(2);
    Noisy wrong = a;
    wrong.mean.at(0, 0)[1] = 0.1f;  // a pixel without noise
    EXPECT_EQ(compare_means(wrong, b).different, 1u);
    wrong = a;
    wrong.mean.at(20, 20)[0] += 100 * std::sqrt(a.variance.at(20, 20)[0] / kSamples);
    EXPECT_LT(compare_means(wrong, b).p_value, 1e-4);
    wrong = a;
    wrong.mean.at(20, 20)[0] = std::nanf("");
    EXPECT_LT(compare_means(wrong, b).p_value, 1e-4);
    wrong = a;
    wrong.mean.at(0, 0)[0] = std::nanf("");
    EXPECT_EQ(compare_means(wrong, b).different, 1u);
}

TEST(ImageTests, ComparesWithExactImages) {
    Image gradient(kSize, kSize, 3);
    for (int y = 0; y < kSize; ++y) {
        for (int x = kSize / 8; x < kSize; ++x) {
            for (int c = 0; c < 3; ++c) gradient.at(x, y)[c] = 0.5f + static_cast<float>(y);
        }
    }
    EXPECT_GT(compare_means(make(3), Exact{gradient}).p_value, 1e-3);
    EXPECT_LT(compare_means(make(3, 1.05), Exact{gradient}).p_value, 1e-4);
}

TEST(ImageTests, ChiSquareTailAgreesWithTables) {
    EXPECT_NEAR(chi_square_tail(18.307, 10), 0.05, 1e-3);  // Abramowitz, Stegun, table 26.8
    EXPECT_NEAR(chi_square_tail(135.807, 100), 0.01, 1e-3);
}

}  // namespace
}  // namespace halflight::test
