// Tests the agreement of two renderers on pictures with known differences and noise.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tools/measure/converge/measure.h"

namespace halflight::converge {
namespace {

constexpr int kSide = 4;  // side of a block, pixels

/// Returns pictures of `blocks` x `blocks` blocks with mean `value`. Every block has independent Gaussian noise of
/// standard deviation `noise`, like the mean of a converged block.
std::vector<Image> noisy(int pictures, int blocks, double value, double noise, unsigned seed) {
    std::mt19937 generator(seed);
    std::normal_distribution<double> normal(value, noise);
    std::vector<Image> result;
    for (int i = 0; i < pictures; ++i) {
        Image& image = result.emplace_back(blocks * kSide, blocks * kSide, 3);
        for (int by = 0; by < blocks; ++by) {
            for (int bx = 0; bx < blocks; ++bx) {
                const auto v = static_cast<float>(normal(generator));
                for (int y = 0; y < kSide; ++y)
                    for (int x = 0; x < kSide; ++x) std::fill_n(image.at(bx * kSide + x, by * kSide + y), 3, v);
            }
        }
    }
    return result;
}

TEST(Agreement, GivesEveryBlockItsOwnError) {
    // Our pictures are exact. The right block of theirs is noisy: 1.1, 1.3 and 1.2 instead of 1.
    std::vector<Image> ours(3, Image(2 * kSide, kSide + 1, 1)), theirs = ours;
    for (Image& image : ours) image.pixels.assign(image.pixels.size(), 1);
    const float right[] = {1.1f, 1.3f, 1.2f};
    for (int i = 0; i < 3; ++i)
        for (int y = 0; y <= kSide; ++y)
            for (int x = 0; x < 2 * kSide; ++x) *theirs[i].at(x, y) = x < kSide ? 0.99f : right[i];
    const Agreement a = compare_pictures(ours, theirs, kSide, 0.02);
    ASSERT_EQ(a.blocks.size(), 2u);  // the last row of pixels fills no block
    EXPECT_NEAR(a.blocks[0].difference.relative, -0.01, 1e-6);
    EXPECT_NEAR(a.blocks[0].difference.standard_error, 0, 1e-9);
    EXPECT_FALSE(a.blocks[0].beyond);
    EXPECT_EQ(a.blocks[1].x, kSide);
    EXPECT_EQ(a.blocks[1].y, 0);
    EXPECT_NEAR(a.blocks[1].difference.relative, 0.2, 1e-6);
    EXPECT_NEAR(a.blocks[1].difference.standard_error, 0.1 / std::sqrt(3.0), 1e-6);
    EXPECT_NEAR(a.blocks[1].difference.freedom, 2, 1e-6);
    EXPECT_TRUE(a.blocks[1].beyond);
    EXPECT_EQ(a.beyond, 1u);
    EXPECT_NEAR(a.whole.relative, 0.095, 1e-6);
    EXPECT_NEAR(a.whole.standard_error, 0.05 / std::sqrt(3.0), 1e-6);
    EXPECT_EQ(a.verdict(), Verdict::undecided) << "three pictures with this scatter do not tell";
}

TEST(Agreement, HasThreeVerdicts) {
    constexpr int kBlocks = 6;
    const auto verdict = [](double ours, double theirs, double noise) {
        return compare_pictures(noisy(6, kBlocks, ours, noise, 1), noisy(6, kBlocks, theirs, noise, 2), kSide)
            .verdict();
    };
    EXPECT_EQ(verdict(1, 1, 0.005), Verdict::agree);
    EXPECT_EQ(verdict(1, 1.005, 0.005), Verdict::agree) << "a difference within the tolerance";
    EXPECT_EQ(verdict(1, 1.03, 0.005), Verdict::differ);
    EXPECT_EQ(verdict(1, 1, 0.5), Verdict::undecided);
    EXPECT_EQ(verdict(1, 1.03, 0.5), Verdict::undecided);
    // Blocks may differ if the mean does not.
    std::vector<Image> ours = noisy(6, 2, 1, 0.001, 1), theirs = noisy(6, 2, 1, 0.001, 2);
    for (Image& image : theirs)
        for (int y = 0; y < image.height; ++y)
            for (int x = 0; x < image.width * 3; ++x) image.at(0, y)[x] *= x < image.width * 3 / 2 ? 1.05f : 0.95f;
    const Agreement a = compare_pictures(ours, theirs, kSide);
    EXPECT_TRUE(a.whole.interval().holds(0));
    EXPECT_EQ(a.verdict(), Verdict::differ);
}

/// Multiplies one block of pictures of noisy().
void scale_block(std::vector<Image>& pictures, int bx, int by, float factor) {
    for (Image& image : pictures)
        for (int y = 0; y < kSide; ++y) {
            float* row = image.at(bx * kSide, by * kSide + y);
            for (int i = 0; i < kSide * 3; ++i) row[i] *= factor;
        }
}

TEST(Agreement, DetectsASingleWrongBlockInTheNoise) {
    constexpr int kBlocks = 20;
    const std::vector<Image> ours = noisy(8, kBlocks, 1, 0.02, 1), theirs = noisy(8, kBlocks, 1, 0.02, 2);
    const Agreement clean = compare_pictures(ours, theirs, kSide);
    EXPECT_GT(clean.expected_beyond, 1) << "noise hides one block among those that it puts beyond the tolerance";
    EXPECT_EQ(clean.verdict(), Verdict::agree);
    for (const float factor : {1.25f, 0.0f}) {
        for (const bool is_ours : {false, true}) {
            std::vector<Image> wrong = is_ours ? ours : theirs;
            scale_block(wrong, 3, 5, factor);
            const Agreement a = compare_pictures(is_ours ? wrong : ours, is_ours ? theirs : wrong, kSide);
            ASSERT_EQ(a.blocks.size(), 400u);
            EXPECT_EQ(a.verdict(), Verdict::differ) << factor << is_ours;
            EXPECT_GT(a.chance_of_beyond, kSignificance) << "the number of blocks does not tell";
            EXPECT_EQ(a.blocks[a.worst].x, 3 * kSide);
            EXPECT_EQ(a.blocks[a.worst].y, 5 * kSide);
            const double black = is_ours ? 1 : -1;
            EXPECT_TRUE(factor > 0 || a.blocks[a.worst].difference.relative == black);
        }
    }
}

TEST(Agreement, TakesABrightSampleInADarkBlockAsNoise) {
    std::vector<Image> ours = noisy(8, 4, 1, 0.005, 1), theirs = noisy(8, 4, 1, 0.005, 2);
    scale_block(ours, 1, 1, 0), scale_block(theirs, 1, 1, 0);
    EXPECT_EQ(compare_pictures(ours, theirs, kSide).blocks.size(), 15u) << "black in both";
    *ours[3].at(kSide, kSide) = 1;
    for (const float dark : {0.0f, 1e-4f}) {
        for (Image& image : theirs) *image.at(kSide, kSide) = dark;
        for (const bool swapped : {false, true}) {
            const Agreement a = compare_pictures(swapped ? theirs : ours, swapped ? ours : theirs, kSide);
            EXPECT_EQ(a.blocks.size(), 16u);
            EXPECT_GT(a.chance_of_worst, 0.1) << dark << swapped;
        }
    }
}

// Each condition of `differ` holds for renderers that agree with a probability of at most kSignificance. The whole has
// a tolerance above its noise here. Bounds are four standard deviations.
TEST(Agreement, SeldomTakesNoiseForADifference) {
    constexpr int kTrials = 400;
    int rare = 0, differ = 0;
    for (unsigned trial = 0; trial < kTrials; ++trial) {
        const auto ours = noisy(6, 4, 1, 0.02, 2 * trial), theirs = noisy(6, 4, 1, 0.03, 2 * trial + 1);
        rare += compare_pictures(ours, theirs, kSide, 0).chance_of_worst < 0.1;
        differ += compare_pictures(ours, theirs, kSide).verdict() == Verdict::differ;
    }
    EXPECT_NEAR(rare, 0.1 * kTrials, 4 * std::sqrt(0.09 * kTrials)) << "Bonferroni's level is nearly exact";
    EXPECT_LE(differ, 2 * kSignificance * kTrials + 4 * std::sqrt(2 * kSignificance * kTrials));
}

// Probabilities of renderers that agree are uniform: a tenth of them is below 0.1, by chance. The bound is four
// standard deviations.
TEST(Agreement, ChiSquareOfNoiseIsUniform) {
    constexpr int kTrials = 400;
    int rare = 0;
    for (unsigned trial = 0; trial < kTrials; ++trial)
        rare += compare_pictures(noisy(6, 4, 1, 0.02, 2 * trial), noisy(6, 4, 1, 0.03, 2 * trial + 1), kSide)
                    .chance_of_blocks < 0.1;
    EXPECT_NEAR(rare, 0.1 * kTrials, 4 * std::sqrt(0.09 * kTrials));
    const Agreement one = compare_pictures(noisy(6, 1, 1, 0.02, 1), noisy(6, 1, 1, 0.02, 2), kSide);
    EXPECT_NEAR(one.chance_of_blocks, one.whole.chance(), 1e-9) << "a single block has Student's test alone";
    EXPECT_LT(compare_pictures(noisy(6, 4, 1, 0.02, 1), noisy(6, 4, 1.05, 0.02, 2), kSide).chance_of_blocks, 1e-6);
}

// Errors are estimated from as few as five pictures. On average, the expected number of blocks beyond the threshold
// must still be right.
TEST(Agreement, ExpectsTheOutliersOfNoise) {
    constexpr int kBlocks = 40;
    const Agreement a = compare_pictures(noisy(5, kBlocks, 1, 0.03, 1), noisy(5, kBlocks, 1, 0.01, 2), kSide, 0.01);
    const double n = kBlocks * kBlocks, share = a.expected_beyond / n;
    EXPECT_GT(share, 0.05);
    EXPECT_LT(share, 0.3);
    // The expectation comes from the same errors and is noisy itself; the bound is six standard deviations instead of
    // four.
    EXPECT_NEAR(static_cast<double>(a.beyond), a.expected_beyond, 6 * std::sqrt(n * share * (1 - share)));
}

TEST(Agreement, DetectsADifferenceInTheNoise) {
    constexpr int kBlocks = 20;
    const Agreement a = compare_pictures(noisy(8, kBlocks, 1, 0.01, 3), noisy(8, kBlocks, 0.95, 0.01, 4), kSide, 0.02);
    EXPECT_GT(a.beyond, 390u);
    EXPECT_LT(a.expected_beyond, 4);
    EXPECT_NEAR(a.whole.relative, -0.05, 4 * a.whole.standard_error);
}

TEST(Agreement, IgnoresBlackBlocks) {
    std::vector<Image> ours(2, Image(kSide, kSide, 3)), theirs = ours;
    const Agreement black = compare_pictures(ours, theirs, kSide, 0.02);
    EXPECT_TRUE(black.blocks.empty());
    EXPECT_EQ(black.verdict(), Verdict::undecided);
}

}  // namespace
}  // namespace halflight::converge
