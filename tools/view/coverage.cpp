#include "tools/view/coverage.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace halflight::view {

Coverage::Coverage(const ivec2& size)
    : size_(glm::max(size, ivec2(0))), pixels_(std::size_t(size_.x) * size_t(size_.y)) {}

void Coverage::add(const Projection& projection, const dvec3& a, const dvec3& b, const dvec3& c) {
    const std::array<dvec3, 3> triangle = {a, b, c};
    const double farthest = -std::min({a.z, b.z, c.z});
    const double near = projection.perspective() ? -kNear * farthest : std::numeric_limits<double>::infinity();
    if (projection.perspective() && !(farthest > 0)) return;
    std::array<dvec2, 4> corners;
    std::size_t count = 0;
    for (std::size_t i = 0; i < 3; ++i) {
        const dvec3 &p = triangle[i], &q = triangle[(i + 1) % 3];
        if (p.z <= near) corners[count++] = projection.flat(p);
        if ((p.z <= near) != (q.z <= near))
            corners[count++] = projection.flat(p + (q - p) * ((near - p.z) / (q.z - p.z)));
    }
    fill({corners.data(), count});
}

/// Covers the pixels whose centres are in a convex polygon.
void Coverage::fill(std::span<const dvec2> corners) {
    constexpr double kSlack = 0.02;  // pixels by which polygons grow, so that neighbours leave no gap
    if (corners.size() < 3) return;
    double top = corners[0].y, bottom = top;
    for (const dvec2& p : corners) top = std::min(top, p.y), bottom = std::max(bottom, p.y);
    if (!std::isfinite(top) || !std::isfinite(bottom)) return;
    const auto row = [&](double y) { return static_cast<int>(std::clamp(y, 0.0, double(size_.y))); };
    for (int y = row(std::ceil(top - kSlack - 0.5)); y < row(std::floor(bottom + kSlack - 0.5) + 1); ++y) {
        const double at = std::clamp(y + 0.5, top, bottom);
        double left = std::numeric_limits<double>::infinity(), right = -left;
        for (std::size_t i = 0; i < corners.size(); ++i) {
            const dvec2 &p = corners[i], &q = corners[(i + 1) % corners.size()];
            if (std::min(p.y, q.y) > at || std::max(p.y, q.y) < at) continue;
            const double t = p.y == q.y ? 0 : (at - p.y) / (q.y - p.y);
            const double x = p.x + t * (q.x - p.x);
            left = std::min(left, x), right = std::max(right, x);
            if (p.y == q.y) left = std::min(left, q.x), right = std::max(right, q.x);
        }
        const auto column = [&](double x) { return static_cast<std::ptrdiff_t>(std::clamp(x, 0.0, double(size_.x))); };
        const auto from = column(std::ceil(left - kSlack - 0.5)), to = column(std::floor(right + kSlack - 0.5) + 1);
        if (from < to) std::fill_n(pixels_.begin() + std::ptrdiff_t{y} * size_.x + from, to - from, std::uint8_t{1});
    }
}

bool Coverage::covers(const dvec2& p) const {
    if (!(p.x >= 0 && p.y >= 0 && p.x < size_.x && p.y < size_.y)) return false;
    return pixels_[static_cast<std::size_t>(p.y) * static_cast<std::size_t>(size_.x) + static_cast<std::size_t>(p.x)] !=
           0;
}

void Coverage::add_outer_parts(const PictureLine& line, std::vector<PictureLine>& lines) const {
    constexpr double kStep = 2, kAside = 2;  // pixels
    constexpr double kMost = 1e5;            // pixels; longer lines reach far beyond the picture
    const dvec2 along = line[1] - line[0];
    const double length = glm::length(along);
    if (!(length > 0) || !std::isfinite(length)) return;
    const dvec2 aside = kAside / length * dvec2(-along.y, along.x);
    const int steps = static_cast<int>(std::ceil(std::min(length, kMost) / kStep));
    const auto at = [&](double i) { return line[0] + i / steps * along; };
    for (int i = 0, begin = -1; i <= steps; ++i) {
        const bool outer = i < steps && !(covers(at(i + 0.5) + aside) && covers(at(i + 0.5) - aside));
        if (outer && begin < 0) begin = i;
        if (!outer && begin >= 0) {
            lines.push_back({at(begin), at(i)});
            begin = -1;
        }
    }
}

}  // namespace halflight::view
