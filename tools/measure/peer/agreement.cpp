#include "tools/measure/peer/agreement.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "engine/core/statistics.h"

namespace halflight::peer {
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

/// The error of a ratio to first order; its degrees of freedom by Welch and Satterthwaite. Precondition: not black.
Difference difference(const RunningMoments& ours, const RunningMoments& theirs) {
    const double ratio = theirs.mean() / ours.mean();
    const double a = std::pow(ratio * ours.standard_error() / ours.mean(), 2);
    const double b = std::pow(theirs.standard_error() / ours.mean(), 2);
    const double weight =
        a * a / static_cast<double>(ours.count() - 1) + b * b / static_cast<double>(theirs.count() - 1);
    return {ratio - 1, std::sqrt(a + b), weight > 0 ? (a + b) * (a + b) / weight : 0};
}

}  // namespace

double mean_squared_error(const Image& a, const Image& b) {
    assert(a.pixels.size() == b.pixels.size());
    double sum = 0;
    for (std::size_t i = 0; i < a.pixels.size(); ++i) sum += std::pow(double{a.pixels[i]} - b.pixels[i], 2);
    return sum / static_cast<double>(a.pixels.size());
}

Converged converge(const std::vector<Image>& pictures) {
    assert(pictures.size() >= 2);
    const Image& first = pictures.front();
    Converged result{Image(first.width, first.height, first.channels)};
    for (std::size_t i = 0; i < first.pixels.size(); ++i) {
        RunningMoments value;
        for (const Image& picture : pictures) value.add(picture.pixels[i]);
        result.mean.pixels[i] = static_cast<float>(value.mean());
        result.squared_error += value.variance() / static_cast<double>(pictures.size());
    }
    result.squared_error /= static_cast<double>(first.pixels.size());
    return result;
}

Agreement compare(const std::vector<Image>& ours, const std::vector<Image>& theirs, int side, double tolerance) {
    assert(ours.size() >= 2 && theirs.size() >= 2 && side > 0);
    const Image& first = ours.front();
    const Rectangle all{0, 0, first.width, first.height};
    Agreement result{side, tolerance, difference(moments(ours, all), moments(theirs, all)), {}, 0, 0};
    for (int y = 0; y + side <= first.height; y += side) {
        for (int x = 0; x + side <= first.width; x += side) {
            const RunningMoments a = moments(ours, {x, y, side, side}), b = moments(theirs, {x, y, side, side});
            if (!(a.mean() > 0) || !(b.mean() > 0)) continue;
            Block block{x, y, difference(a, b), false, 0};
            const auto& [relative, error, freedom] = block.difference;
            block.beyond = std::abs(relative) > tolerance + error;
            if (error > 0) block.chance_of_beyond = student_tails(tolerance / error + 1, freedom);
            result.beyond += block.beyond;
            result.expected_beyond += block.chance_of_beyond;
            result.blocks.push_back(block);
        }
    }
    return result;
}

}  // namespace halflight::peer
