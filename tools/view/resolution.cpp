#include "tools/view/resolution.h"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace halflight::view {
namespace {

constexpr int kFirst = 8;
constexpr double kFading = 0.98;  // of other sizes' seconds, by picture: a time of twice the budget is tried after 35

std::size_t pixels_of(const ivec2& size) {
    return static_cast<std::size_t>(size.x) * static_cast<std::size_t>(size.y);
}

}  // namespace

ivec2 divided(const ivec2& size, int divisor) {
    return glm::max((size + divisor - 1) / divisor, ivec2(1));
}

int Resolution::divisor(const ivec2& size) const {
    if (seconds_.empty()) return kFirst;
    for (int d = 1; d < kCoarsest; d *= 2)
        if (expected(pixels_of(divided(size, d))) <= budget_) return d;
    return kCoarsest;
}

void Resolution::took(const ivec2& size, double seconds) {
    for (auto& [pixels, known] : seconds_)
        if (pixels != pixels_of(size)) known *= kFading;
    const auto [known, is_new] = seconds_.try_emplace(pixels_of(size), seconds);
    if (!is_new) known->second = 0.5 * known->second + 0.5 * seconds;
}

/// A time that does not depend on the size and one that is proportional to it, through the nearest sizes known; where
/// only one is known, all of its time counts as proportional towards finer pictures, and none towards coarser ones.
double Resolution::expected(std::size_t pixels) const {
    const auto above = seconds_.lower_bound(pixels);
    if (above != seconds_.end() && above->first == pixels) return above->second;
    if (seconds_.size() == 1) {
        const auto& [known, time] = *seconds_.begin();
        return pixels > known ? time * static_cast<double>(pixels) / static_cast<double>(known) : time;
    }
    auto b = above == seconds_.begin() ? std::next(above) : above == seconds_.end() ? std::prev(above) : above;
    const auto a = std::prev(b);
    const double slope = std::max((b->second - a->second) / static_cast<double>(b->first - a->first), 0.0);
    return std::max(a->second + slope * (static_cast<double>(pixels) - static_cast<double>(a->first)), 0.0);
}

}  // namespace halflight::view
