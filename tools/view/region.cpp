#include "tools/view/region.h"

namespace halflight::view {

std::optional<Region> region_of(const PixelWindow& window, const ivec2& size) {
    const ivec2 first = glm::clamp(window.first, ivec2(0), size), end = glm::clamp(window.end, ivec2(0), size);
    if (first.x >= end.x || first.y >= end.y) return std::nullopt;
    return Region{dvec2(first) / dvec2(size), dvec2(end) / dvec2(size)};
}

std::optional<PixelWindow> pixels_of(const Region& region, const ivec2& size) {
    PixelWindow window{ivec2(glm::round(region.first * dvec2(size))), ivec2(glm::round(region.end * dvec2(size)))};
    window.first = glm::min(window.first, size - 1);
    window.end = glm::max(window.end, window.first + 1);
    if (window == PixelWindow{{0, 0}, size}) return std::nullopt;
    return window;
}

bool contains(const PixelWindow& window, const ivec2& p) {
    return p.x >= window.first.x && p.y >= window.first.y && p.x < window.end.x && p.y < window.end.y;
}

PixelWindow window_between(const dvec2& a, const dvec2& b) {
    return {ivec2(glm::floor(glm::min(a, b))), ivec2(glm::ceil(glm::max(a, b)))};
}

}  // namespace halflight::view
