// What stands on the picture itself, with panels or without: scales of colours, what is biased or has gone wrong, the
// line between two pictures.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tools/view/seen.h"

namespace halflight::view {

/// Where labels may be, pixels across the window.
struct Room {
    float left;
    float right;
};

struct Overlay {
    std::optional<Scale> scale;        // of the colours that are seen
    std::vector<std::string> notices;  // that have to be seen, a line each
    std::string here;                  // what it shows, in a few words
    std::optional<std::string> other;  // and the one that it is compared with; none: it is alone
    std::optional<Room> room;          // none: all of the window
};

/// Between Gui::begin() and draw(). `split`: as of Display, moved by dragging the line.
void draw_overlay(const Overlay& overlay, float& split);

}  // namespace halflight::view
