#include "tools/measure/converge/agreement.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace halflight::converge {
namespace {

struct Rectangle {
    int x, y, width, height;
};

double mean_over(const Image& image, const Rectangle& r) {
    double sum = 0;
    for (int y = r.y; y < r.y + r.height; ++y) {
        const float* row = image.at(r.x, y);
        for (int i = 0; i < r.width * image.channels; ++i) sum += row[i];
    }
    return sum / (1.0 * r.width * r.height * image.channels);
}

RunningMoments moments(const std::vector<Image>& pictures, const Rectangle& r) {
    RunningMoments means;
    for (const Image& picture : pictures) means.add(mean_over(picture, r));
    return means;
}

/// Returns the degrees of freedom of the sum of two variances of means; 0 without noise.
double freedom_of(double a, const RunningMoments& ours, double b, const RunningMoments& theirs) {
    const double weight =
        a * a / static_cast<double>(ours.count() - 1) + b * b / static_cast<double>(theirs.count() - 1);
    return weight > 0 ? (a + b) * (a + b) / weight : 0;
}

/// Returns theirs / ours - 1 with its standard error; NaN if both means are black.
Difference difference(const RunningMoments& ours, const RunningMoments& theirs) {
    if ((ours.mean() > 0) != (theirs.mean() > 0)) {  // a ratio would be infinite, or have no error
        const RunningMoments& lit = ours.mean() > 0 ? ours : theirs;
        const double error = lit.standard_error() / lit.mean();
        return {&lit == &ours ? -1.0 : 1.0, error, error > 0 ? static_cast<double>(lit.count() - 1) : 0};
    }
    const double ratio = theirs.mean() / ours.mean();
    const double a = std::pow(ratio * ours.standard_error() / ours.mean(), 2);
    const double b = std::pow(theirs.standard_error() / ours.mean(), 2);
    return {ratio - 1, std::sqrt(a + b), freedom_of(a, ours, b, theirs)};
}

/// Returns the probability that noise alone puts `theirs` this far outside of ours (1 +- tolerance). Tests the values
/// rather than their ratio (Fieller 1954), whose first-order error is too small if `ours` has rare bright samples.
double chance_outside(const RunningMoments& ours, const RunningMoments& theirs, double tolerance) {
    const double sign = theirs.mean() > ours.mean() ? 1 : -1, bound = 1 + sign * tolerance;
    const double excess = sign * (theirs.mean() - bound * ours.mean());
    if (!(excess > 0)) return 1;
    const double a = std::pow(bound * ours.standard_error(), 2), b = std::pow(theirs.standard_error(), 2);
    const double freedom = freedom_of(a, ours, b, theirs);
    return freedom > 0 ? student_tails(excess / std::sqrt(a + b), freedom) : 0;
}

/// Returns the probability that a Poisson variable is less than `count`. With half of x as mean, it is the probability
/// that chi-square with 2 `count` degrees of freedom exceeds x.
double poisson_below(std::size_t count, double mean) {
    if (mean <= 0) return count > 0 ? 1 : 0;
    double sum = 0;
    for (std::size_t k = 0; k < count; ++k) {
        const auto n = static_cast<double>(k);
        sum += std::exp(n * std::log(mean) - mean - std::lgamma(n + 1));
    }
    return std::min(sum, 1.0);
}

/// Returns the probability that noise alone makes the differences of all blocks, whose noise is independent. Minus
/// twice the sum of the logarithms of their probabilities is chi-square with two degrees of freedom each (Fisher 1932).
double chance_of(const std::vector<Block>& blocks) {
    constexpr double kLeast = 1e-300;
    double logarithms = 0;
    for (const Block& block : blocks) logarithms -= std::log(std::max(block.difference.chance(), kLeast));
    return blocks.empty() ? 1 : poisson_below(blocks.size(), logarithms);
}

/// Writes the colour of a relative difference: blue at -scale, white at 0, red at +scale.
void paint(float* pixel, double difference, double scale) {
    const float t = static_cast<float>(std::clamp(difference / scale, -1.0, 1.0));
    pixel[0] = 1 - std::max(-t, 0.0f), pixel[1] = 1 - std::abs(t), pixel[2] = 1 - std::max(t, 0.0f);
}

Image grey(int width, int height) {
    Image image(width, height, 3);
    std::ranges::fill(image.pixels, 0.5f);
    return image;
}

}  // namespace

Interval Difference::interval() const {
    return {relative, standard_error > 0 ? student_quantile(kConfidence, freedom) * standard_error : 0};
}

double Difference::chance() const {
    if (standard_error > 0) return student_tails(std::abs(relative) / standard_error, freedom);
    return relative == 0 ? 1 : 0;
}

std::string_view name(Verdict verdict) {
    return verdict == Verdict::agree ? "agree" : verdict == Verdict::differ ? "differ" : "undecided";
}

Verdict Agreement::verdict() const {
    const Interval mean = whole.interval();
    if (mean.lower() > kWholeTolerance || mean.upper() < -kWholeTolerance || chance_of_beyond < kSignificance ||
        chance_of_worst < kSignificance)
        return Verdict::differ;
    const bool inside = mean.lower() >= -kWholeTolerance && mean.upper() <= kWholeTolerance;
    return inside && expected_beyond <= kMostNoisy * static_cast<double>(blocks.size()) ? Verdict::agree
                                                                                        : Verdict::undecided;
}

Agreement compare_pictures(const std::vector<Image>& ours, const std::vector<Image>& theirs, int side,
                           double tolerance) {
    assert(ours.size() >= 2 && theirs.size() >= 2 && side > 0);
    const Image& first = ours.front();
    const Rectangle all{0, 0, first.width, first.height};
    Agreement result{.side = side,
                     .tolerance = tolerance,
                     .whole = difference(moments(ours, all), moments(theirs, all)),
                     .blocks = {}};
    for (int y = 0; y + side <= first.height; y += side) {
        for (int x = 0; x + side <= first.width; x += side) {
            const RunningMoments a = moments(ours, {x, y, side, side}), b = moments(theirs, {x, y, side, side});
            if (!(a.mean() > 0) && !(b.mean() > 0)) continue;
            Block block{x, y, difference(a, b), false, 0, chance_outside(a, b, tolerance)};
            const auto& [relative, error, freedom] = block.difference;
            block.beyond = std::abs(relative) > tolerance + error;
            if (error > 0) block.chance_of_beyond = student_tails(tolerance / error + 1, freedom);
            result.beyond += block.beyond;
            result.expected_beyond += block.chance_of_beyond;
            result.blocks.push_back(block);
        }
    }
    if (result.beyond > 0) result.chance_of_beyond = 1 - poisson_below(result.beyond, result.expected_beyond);
    result.chance_of_blocks = chance_of(result.blocks);
    if (!result.blocks.empty()) {
        const auto worst = std::ranges::min_element(result.blocks, {}, &Block::chance);
        result.worst = static_cast<std::size_t>(worst - result.blocks.begin());
        result.chance_of_worst = std::min(1.0, worst->chance * static_cast<double>(result.blocks.size()));
    }
    return result;
}

Image relative_difference_picture(const Image& ours, const Image& theirs, double scale) {
    Image picture = grey(ours.width, ours.height);
    const auto sum = [](const float* pixel) { return double{pixel[0]} + pixel[1] + pixel[2]; };
    for (int y = 0; y < ours.height; ++y)
        for (int x = 0; x < ours.width; ++x)
            if (const double mine = sum(ours.at(x, y)); mine > 0)
                paint(picture.at(x, y), sum(theirs.at(x, y)) / mine - 1, scale);
    return picture;
}

Image block_difference_picture(const Agreement& agreement, int width, int height, double scale) {
    Image picture = grey(width, height);
    for (const Block& b : agreement.blocks)
        for (int y = b.y; y < b.y + agreement.side; ++y)
            for (int x = b.x; x < b.x + agreement.side; ++x) paint(picture.at(x, y), b.difference.relative, scale);
    return picture;
}

}  // namespace halflight::converge
