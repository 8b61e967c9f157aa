// Rectangles of the window: menu, picture, side bar, status line. They never overlap. Pure functions.
#pragma once

#include "engine/core/math.h"

namespace halflight::view {

/// Rectangle of the window, pixels of the framebuffer, from its upper left corner.
struct Rectangle {
    ivec2 origin{0};
    ivec2 size{0};
    ivec2 end() const { return origin + size; }
    bool contains(const dvec2& point) const;
    bool operator==(const Rectangle&) const = default;
};

/// Sizes of the parts beside the picture, pixels. 0: the part is hidden.
struct Parts {
    int menu = 0;    // height of the menu bar
    int status = 0;  // height of the status line
    int side = 0;    // width of the side bar
};

struct WindowLayout {
    Rectangle area;     // area for the picture
    Rectangle picture;  // picture within the area, with its own aspect
    Rectangle side;     // side bar, right of the area
    Rectangle status;   // status line, below both
};

/// Lays out a window of `size` pixels around a picture of `picture` pixels. The picture has its own size if the area
/// differs by less than two pixels; otherwise it is scaled to fit. The side bar of a narrow window is narrower than
/// wanted, so that a third of the window is left for the picture.
WindowLayout lay_out(const ivec2& size, const Parts& parts, const ivec2& picture);

/// Returns the size of a window that shows a picture at its own size, at most `most`.
ivec2 window_size(const ivec2& picture, const Parts& parts, const ivec2& most);

/// Returns the point of the picture at a point of the window, pixels of the picture. It lies outside of the picture
/// where the point of the window does.
dvec2 picture_point(const WindowLayout& layout, const ivec2& picture, const dvec2& point);

}  // namespace halflight::view
