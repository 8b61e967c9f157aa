// The view transform that a picture is shown through.
#pragma once

#include <string>

namespace halflight {

/// A requested view transform. Names are those of the config, case-insensitive; a display's trailing " - Display" may
/// be omitted.
struct ViewTransform {
    std::string display;  // empty: the config's default
    std::string view;     // empty: the display's default
    std::string look;     // empty: the view's own looks; otherwise replaces them ("a, -b": a, then the inverse of b)
    float exposure = 0;   // stops; radiance is first multiplied by 2^exposure
    bool operator==(const ViewTransform&) const = default;
};

}  // namespace halflight
