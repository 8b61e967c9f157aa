// Comparing noisy images: z-tests on stored mean and variance. A failure leaves image, reference and z map behind.
#pragma once

#include <gtest/gtest.h>

#include <string>

#include "engine/core/image.h"

namespace halflight::test {

/// Chance of a chi-square of k degrees of freedom being as high as x (Wilson, Hilferty 1931; good from k = 5 on).
double chi_square_tail(double x, double k);

/// A Monte Carlo image: per-pixel mean, and unbiased variance of one sample. Same size and channels.
struct Estimate {
    const Image& mean;
    const Image& variance;
    double samples = 1;  // per pixel, >= 1
};

/// An image without noise, of which `samples` do not matter.
struct Exact {
    const Image& mean;
};

/// Of a standard normal: the shares of |z| > 2 and > 3.
inline constexpr double kNormalAbove2 = 0.0455;
inline constexpr double kNormalAbove3 = 0.0027;

/// Welch's test of a against b, per block and channel: z = (mean_a - mean_b) / sqrt(var_a / n_a + var_b / n_b).
struct ZTest {
    Image z;                    // as many channels as the images; one pixel per block
    std::size_t tested = 0;     // z values with a variance above 0
    std::size_t untested = 0;   // without any variance, and the same on both sides but for float rounding: z = 0
    std::size_t different = 0;  // without any variance, yet not the same: z = +-inf, not part of what follows
    double above_2 = 0;         // share of tested with |z| > 2
    double above_3 = 0;
    double greatest = 0;  // |z|
    double p_value = 1;   // that a sum of z^2 as high as this is chance: the least of the channels, times their number
    double relative_difference = 0;  // (sum a - sum b) / sum b over all pixels and channels
    double relative_error = 0;       // its standard error, channels taken as fully correlated
};

/// `block` x `block` pixels are averaged first (the last row and column of blocks may be smaller). Single pixels need
/// some 64 samples with light tails for z to be normal; blocks get there with fewer.
ZTest compare_means(const Estimate& a, const Estimate& b, int block = 1);
ZTest compare_means(const Estimate& a, const Exact& b, int block = 1);

/// One line with all the numbers.
std::string describe(const ZTest& test);

/// Writes NAME-image, NAME-reference and NAME-z into `folder`: each as .pfm (data) and .ppm (to look at: sRGB; z from
/// blue at -4 over white to red at 4). Returns a sentence that names them. Creates the folder.
std::string save_failure(const std::string& folder, const std::string& name, const Image& image, const Image& reference,
                         const Image& z);
/// The same into test-failures/ of the build folder.
std::string save_failure(const std::string& name, const Image& image, const Image& reference, const Image& z);

struct Agreement {
    int block = 1;
    double p_value = 1e-4;              // at least
    double above_3 = 1;                 // at most; for tails too heavy for the p value, set p_value = 0 and this
    double relative_difference = 0.01;  // at most, beyond four standard errors
};

/// EXPECT_TRUE(agree("cornell", gl, oracle)): compares, and on failure saves the images and says all that is known.
::testing::AssertionResult agree(const std::string& name, const Estimate& a, const Estimate& b,
                                 const Agreement& limits = {});

}  // namespace halflight::test
