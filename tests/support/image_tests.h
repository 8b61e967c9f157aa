// Compares noisy images by z-tests on stored mean and variance. A failure saves image, reference and z map.
#pragma once

#include <gtest/gtest.h>

#include <string>

#include "engine/core/image.h"

namespace halflight::test {

/// Returns the probability that a chi-square of k degrees of freedom is at least x (Wilson, Hilferty 1931; accurate for
/// k >= 5).
double chi_square_tail(double x, double k);

/// Monte Carlo estimate: per-pixel mean, and unbiased variance of one sample, as images of equal size and channels.
struct Estimate {
    const Image& mean;
    const Image& variance;
    double samples = 1;  // samples per pixel, >= 1
};

/// Image without noise.
struct Exact {
    const Image& mean;
};

/// Probabilities of |z| > 2 and |z| > 3 for a standard normal z.
inline constexpr double kNormalAbove2 = 0.0455;
inline constexpr double kNormalAbove3 = 0.0027;

/// Result of Welch's test of a against b by block and channel: z = (mean_a - mean_b) / sqrt(var_a / n_a + var_b / n_b).
struct ZTest {
    Image z;                    // one pixel per block; the channels are those of the images
    std::size_t tested = 0;     // z values with a variance above 0
    std::size_t untested = 0;   // values without variance that are equal except for float rounding: z = 0
    std::size_t different = 0;  // values without variance that differ: z = +-inf, not part of the fields below
    double above_2 = 0;         // share of tested values with |z| > 2
    double above_3 = 0;         // share of tested values with |z| > 3
    double greatest = 0;        // greatest |z|
    double p_value = 1;         // probability of this sum of z^2 by chance: the least over channels, times their number
    double relative_difference = 0;  // (sum a - sum b) / sum b over all pixels and channels
    double relative_error = 0;       // standard error of relative_difference, channels taken as fully correlated
};

/// Tests the means of blocks of `block` x `block` pixels; the last row and column may be smaller. For single pixels, z
/// is about normal if there are at least 64 samples with light tails.
ZTest compare_means(const Estimate& a, const Estimate& b, int block = 1);
ZTest compare_means(const Estimate& a, const Exact& b, int block = 1);

/// Returns one line with all results.
std::string describe(const ZTest& test);

/// Writes NAME-image, NAME-reference and NAME-z into `folder`, which is created. Each is a .pfm (data) and a .ppm (to
/// look at: sRGB; z from blue at -4 over white to red at 4). Returns a sentence that names the files.
std::string save_failure(const std::string& folder, const std::string& name, const Image& image, const Image& reference,
                         const Image& z);
/// Writes the three images into test-failures/ of the build folder.
std::string save_failure(const std::string& name, const Image& image, const Image& reference, const Image& z);

struct Agreement {
    int block = 1;                      // side of a block, pixels
    double p_value = 1e-4;              // least p value
    double above_3 = 1;                 // greatest share; replaces the p value (then 0) if tails are heavy
    double relative_difference = 0.01;  // greatest difference beyond four standard errors
};

/// Compares two images, for EXPECT_TRUE(agree("cornell", gl, oracle)). A failure saves the images and reports all
/// results.
::testing::AssertionResult agree(const std::string& name, const Estimate& a, const Estimate& b,
                                 const Agreement& limits = {});

}  // namespace halflight::test
