// Drawings on top of the picture, with or without panels: colour scale, biases, errors, and the line between two
// pictures.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tools/view/layer_view.h"
#include "tools/view/window_layout.h"

namespace halflight::view {

struct Overlay {
    Rectangle area;                    // area of the picture; labels stay in it
    Rectangle picture;                 // picture in that area
    std::optional<Scale> scale;        // colour scale of the picture; none: plain colours
    std::vector<std::string> notices;  // lines that must be visible, such as biases and errors
    std::string here;                  // short description of the picture
    std::optional<std::string> other;  // short description of the comparison picture; none: no comparison
    std::string shown;                 // which picture is shown, if both are not; empty: a line divides them
};

/// Returns the area without the height at its lower end that a colour scale takes.
Rectangle above_scale(Rectangle area);

/// Draws the overlay; call it between Gui::begin() and draw(). `split` is that of Display::draw(); dragging the line
/// changes it.
void draw_overlay(const Overlay& overlay, float& split);

}  // namespace halflight::view
