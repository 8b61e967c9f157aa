// A region of the picture that takes further samples while the rest keeps its samples. Needs no window.
#pragma once

#include <optional>

#include "engine/settings/data_window.h"

namespace halflight::view {

/// Rectangle as shares of the picture's width and height, in [0, 1]. It keeps its place if the size changes.
struct Region {
    dvec2 first{0};
    dvec2 end{1};
    bool operator==(const Region&) const = default;
};

/// Returns the region of a rectangle of pixels, which is cut at the edges of a picture of `size` pixels; none if
/// less than a pixel is left.
std::optional<Region> region_of(const PixelWindow& window, const ivec2& size);
/// Returns the pixels of a region, at least one; none if the region is the whole picture.
std::optional<PixelWindow> pixels_of(const Region& region, const ivec2& size);
bool contains(const PixelWindow& window, const ivec2& pixel);
/// Returns the pixels of the rectangle with two opposite corners, pixels of the picture.
PixelWindow window_between(const dvec2& a, const dvec2& b);

}  // namespace halflight::view
