#include "tools/view/resolution.h"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace halflight::view {
namespace {

constexpr int kFirst = 8;
// Factor per picture on other sizes' times: a size of twice the budget is tried again after 35 pictures.
constexpr double kFading = 0.98;

std::size_t pixels_of(const ivec2& size) {
    return static_cast<std::size_t>(size.x) * static_cast<std::size_t>(size.y);
}

}  // namespace

ivec2 divided(const ivec2& size, int divisor) {
    return glm::max((size + divisor - 1) / divisor, ivec2(1));
}

bool worth_finer(double seconds, int divisor, double budget) {
    constexpr double kPatience = 4;  // budgets
    return divisor > 2 && seconds * divisor * divisor > kPatience * budget;
}

int Resolution::divisor(const ivec2& size) const {
    if (recorded_.empty()) return kFirst;
    for (int d = 1; d < kCoarsest; d *= 2)
        if (expected_seconds(pixels_of(divided(size, d))) <= budget_) return d;
    return kCoarsest;
}

void Resolution::record(const ivec2& size, double seconds) {
    for (auto& [pixels, known] : recorded_)
        if (pixels != pixels_of(size)) known.seconds *= kFading;
    const auto [known, is_new] = recorded_.try_emplace(pixels_of(size), Recorded{seconds, 0});
    if (!is_new) known->second.seconds = 0.5 * known->second.seconds + 0.5 * seconds;
    known->second.when = ++records_;
}

/// Interpolates linearly between the nearest recorded sizes: a constant plus a time per pixel. With one recorded size,
/// its whole time counts as proportional for finer pictures, and as constant for coarser ones. A time is at most
/// proportional to that of a coarser picture that was recorded later, so that one slow picture does not count for long.
double Resolution::expected_seconds(std::size_t pixels) const {
    const auto above = recorded_.lower_bound(pixels);
    const auto proportional = [&](auto known) {
        return known->second.seconds * static_cast<double>(pixels) / static_cast<double>(known->first);
    };
    if (above != recorded_.end() && above->first == pixels) {
        if (above == recorded_.begin() || std::prev(above)->second.when < above->second.when)
            return above->second.seconds;
        return std::min(above->second.seconds, proportional(std::prev(above)));
    }
    if (recorded_.size() == 1) {
        const auto known = recorded_.begin();
        return pixels > known->first ? proportional(known) : known->second.seconds;
    }
    auto b = above == recorded_.begin() ? std::next(above) : above == recorded_.end() ? std::prev(above) : above;
    const auto a = std::prev(b);
    const double slope =
        std::max((b->second.seconds - a->second.seconds) / static_cast<double>(b->first - a->first), 0.0);
    return std::max(a->second.seconds + slope * (static_cast<double>(pixels) - static_cast<double>(a->first)), 0.0);
}

}  // namespace halflight::view
