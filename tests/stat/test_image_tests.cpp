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
        EXPECT_LT(std::abs(test.relative_difference), 3 * test.relative_error);
    }
    EXPECT_EQ(compare_means(a, b).untested, 3u * kSize * kSize / 8);
    EXPECT_TRUE(agree("image-tests-equal", a, b));
}

TEST(ImageTests, RefusesSmallBiasOneWrongPixelAndNaN) {
    const Noisy a = make(1), b = make(2), biased = make(1, 1.02);  // 2 % are a fifth of a pixel's standard error
    EXPECT_LT(compare_means(biased, b, 16).p_value, 1e-4);
    const ::testing::AssertionResult result = agree("image-tests-bias", biased, b, {.block = 16});
    ASSERT_FALSE(result);
    const std::string message = result.message();
    const std::size_t end = message.find("-image.ppm"), start = message.rfind(' ', end) + 1;
    for (const char* suffix : {"-image.ppm", "-reference.ppm", "-z.ppm", "-image.pfm", "-reference.pfm", "-z.pfm"})
        EXPECT_TRUE(std::filesystem::remove(message.substr(start, end - start) + suffix)) << suffix;
    const float far = a.mean.at(20, 20)[0] + 100 * std::sqrt(a.variance.at(20, 20)[0] / kSamples);
    for (const float value : {far, std::nanf("")}) {
        Noisy wrong = a;
        wrong.mean.at(20, 20)[0] = value;
        EXPECT_LT(compare_means(wrong, b).p_value, 1e-4) << value;
        wrong = a;
        wrong.mean.at(0, 0)[1] = value;  // a pixel without noise
        EXPECT_EQ(compare_means(wrong, b).different, 1u) << value;
    }
}

TEST(ImageTests, ChiSquareTailAgreesWithTables) {
    EXPECT_NEAR(chi_square_tail(18.307, 10), 0.05, 1e-3);  // Abramowitz, Stegun, table 26.8
    EXPECT_NEAR(chi_square_tail(135.807, 100), 0.01, 1e-3);
}

}  // namespace
}  // namespace halflight::test
