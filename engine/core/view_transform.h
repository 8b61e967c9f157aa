// The view transform of display images.
#pragma once

#include <string>

namespace halflight {

/// A requested view transform. Names are those of the config, case-insensitive; a display's trailing " - Display" may
/// be omitted.
struct ViewTransform {
    std::string display;  // name of the display; empty: the config's default
    std::string view;     // name of the view; empty: the display's default
    std::string look;     // looks; empty: the view's own; otherwise replaces them ("a, -b": a, then the inverse of b)
    float exposure = 0;   // stops; radiance is first multiplied by 2^exposure
    bool operator==(const ViewTransform&) const = default;
};

}  // namespace halflight
