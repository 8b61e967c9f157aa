#include "tools/view/window_layout.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace halflight::view {
namespace {

/// Returns the rectangle of a picture in an area: centred, scaled to fit.
Rectangle fitted(const Rectangle& area, const ivec2& picture) {
    constexpr int kNear = 2;  // pixels that are left empty rather than resampling the picture
    const ivec2 free = area.size - picture;
    ivec2 size = picture;
    const bool fits = std::min(free.x, free.y) >= 0 && std::min(free.x, free.y) < kNear;
    if (!fits) {
        const double scale = std::min(double(area.size.x) / picture.x, double(area.size.y) / picture.y);
        size = glm::max(ivec2(glm::round(scale * dvec2(picture))), ivec2(1));
    }
    return {area.origin + (area.size - size) / 2, size};
}

}  // namespace

bool Rectangle::contains(const dvec2& point) const {
    return point.x >= origin.x && point.y >= origin.y && point.x < end().x && point.y < end().y;
}

WindowLayout lay_out(const ivec2& size, const Parts& parts, const ivec2& picture) {
    WindowLayout l;
    const int side = std::min(parts.side, size.x / 2);
    const int height = std::max(size.y - parts.menu - parts.status, 1);
    l.area = {{0, parts.menu}, {std::max(size.x - side, 1), height}};
    l.side = {{size.x - side, parts.menu}, {side, height}};
    l.status = {{0, size.y - parts.status}, {size.x, parts.status}};
    l.picture = fitted(l.area, glm::max(picture, ivec2(1)));
    return l;
}

ivec2 window_size(const ivec2& picture, const Parts& parts, const ivec2& most) {
    return glm::min(picture + ivec2(parts.side, parts.menu + parts.status), most);
}

dvec2 picture_point(const WindowLayout& layout, const ivec2& picture, const dvec2& point) {
    return (point - dvec2(layout.picture.origin)) * dvec2(picture) / dvec2(layout.picture.size);
}

}  // namespace halflight::view
