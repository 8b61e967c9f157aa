// Tests whether two renderers converge to the same picture, from several independent pictures of each. Their scatter
// gives the noise of every block of pixels, also if samples within one picture are correlated.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "engine/core/image.h"
#include "engine/core/statistics.h"

namespace halflight::converge {

// Largest relative difference of renderers that agree, for the whole picture and for each block, relative to the first
// one's mean. A block's tolerance grows by one standard error.
inline constexpr double kWholeTolerance = 0.01;
inline constexpr double kBlockTolerance = 0.02;
inline constexpr int kBlockSide = 16;          // side of a block, pixels
inline constexpr double kSignificance = 0.01;  // probability below which noise does not explain the blocks
inline constexpr double kMostNoisy = 0.1;      // largest share of blocks that noise may put beyond their tolerance

/// Relative difference of two means over pixels and channels. If one mean is black, it is -1 (theirs) or 1 (ours).
struct Difference {
    double relative = 0;        // theirs / ours - 1, or -1 or 1
    double standard_error = 0;  // standard error of `relative`, to first order
    double freedom = 0;         // degrees of freedom of that error (Welch 1947, Satterthwaite 1946); 0 without noise

    Interval interval() const;  ///< Returns the interval of `relative` by Student's t.
    double chance() const;      ///< Returns the probability that noise alone makes a difference at least this large.
};

enum class Verdict : std::uint8_t { agree, differ, undecided };  // undecided: the noise is too large to tell
std::string_view name(Verdict verdict);

struct Block {
    int x = 0;  // column of the upper left pixel
    int y = 0;
    Difference difference;
    bool beyond = false;          // |relative| > tolerance + standard error
    double chance_of_beyond = 0;  // probability of `beyond` for renderers that agree and have this noise
    double chance = 1;  // probability that noise alone puts a difference within the tolerance this far outside
};

struct Agreement {
    int side = 0;          // side of a block, pixels
    double tolerance = 0;  // relative tolerance of blocks
    Difference whole;
    std::vector<Block> blocks;    // rows from the top; neither incomplete blocks nor those that are black in both
    std::size_t beyond = 0;       // number of blocks beyond the tolerance
    double expected_beyond = 0;   // expected value of `beyond` due to noise alone
    double chance_of_beyond = 1;  // probability that noise alone puts at least `beyond` blocks there
    double chance_of_blocks = 1;  // probability that noise alone makes the differences of all blocks, by chi-square
    double chance_of_worst = 1;   // bound of the probability that noise alone makes any `chance` so small (Bonferroni)
    std::size_t worst = 0;        // index of the block with the smallest `chance`; 0 without blocks

    /// Returns whether the renderers agree. They differ in three cases. The interval of the whole is outside of its
    /// tolerance. Noise puts so many blocks beyond theirs with a probability below kSignificance. Or the interval of
    /// one block is outside at the confidence 1 - kSignificance / blocks. They agree if the interval of the whole is
    /// inside, and noise alone puts no more than kMostNoisy of the blocks beyond.
    Verdict verdict() const;
};

/// Compares pictures of one renderer with those of another: at least two of each, of the same size and channels. Two
/// renderers that agree differ by Student's t times the standard error, so that with a tolerance of 0 about a third of
/// the blocks is beyond.
Agreement compare_pictures(const std::vector<Image>& ours, const std::vector<Image>& theirs, int side = kBlockSide,
                           double tolerance = kBlockTolerance);

/// Returns a picture of the relative difference theirs / ours - 1 by pixel, display-encoded. Colours go from blue at
/// -scale over white to red at +scale; grey: `ours` is black. 3 channels each, of the same size.
Image relative_difference_picture(const Image& ours, const Image& theirs, double scale);
/// Returns a picture of the relative differences of blocks in the same colours; grey outside of blocks.
Image block_difference_picture(const Agreement& agreement, int width, int height, double scale);

}  // namespace halflight::converge
