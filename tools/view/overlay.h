// Drawings on top of the picture, with or without panels: colour scale, biases, errors, and the line between two
// pictures.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tools/view/layer_view.h"

namespace halflight::view {

/// Horizontal range for labels, pixels of the window.
struct LabelArea {
    float left;
    float right;
};

struct Overlay {
    std::optional<Scale> scale;           // colour scale of the picture; none: plain colours
    std::vector<std::string> notices;     // lines that must be visible, such as biases and errors
    std::string here;                     // short description of the picture
    std::optional<std::string> other;     // short description of the comparison picture; none: no comparison
    std::optional<LabelArea> label_area;  // area for labels; none: the whole window
};

/// Draws the overlay; call it between Gui::begin() and draw(). `split` is that of Display::draw(); dragging the line
/// changes it.
void draw_overlay(const Overlay& overlay, float& split);

}  // namespace halflight::view
