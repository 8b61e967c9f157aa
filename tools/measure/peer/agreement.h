// Do two renderers make the same picture? Told from several independent pictures of each, so that the noise of every
// part is known from how they scatter, whatever their samplers correlate within one.
#pragma once

#include <cstddef>
#include <vector>

#include "engine/core/image.h"

namespace halflight::peer {

/// Mean over pixels and channels of the squared difference. Same size and channels.
double mean_squared_error(const Image& a, const Image& b);

/// The mean of independent pictures.
struct Converged {
    Image mean;
    double squared_error = 0;  // of the mean, expected: variance of the pictures by their number, as mean_squared_error
};

/// At least two pictures of the same size and channels.
Converged converge(const std::vector<Image>& pictures);

/// A mean of theirs beside ours, over pixels and channels.
struct Difference {
    double relative = 0;  // theirs / ours - 1
    double error = 0;     // its standard error
    double freedom = 0;   // degrees of freedom of that error (Welch, Satterthwaite); 0 where there is no noise
};

struct Block {
    int x = 0;  // upper left pixel
    int y = 0;
    Difference difference;
    bool beyond = false;          // |relative| > tolerance + error
    double chance_of_beyond = 0;  // that it is where the two agree but for their noise
};

struct Agreement {
    int side = 0;          // of a block, pixels
    double tolerance = 0;  // relative
    Difference whole;
    std::vector<Block> blocks;  // top row first; whole blocks only, without those that are black in either
    std::size_t beyond = 0;
    double expected_beyond = 0;  // by noise alone
};

/// At least two pictures of either, all of the same size and of as many channels. Two renderers that agree differ by
/// Student's t times the error, so that even without any tolerance a third of the blocks is beyond one error.
Agreement compare(const std::vector<Image>& ours, const std::vector<Image>& theirs, int side, double tolerance);

}  // namespace halflight::peer
