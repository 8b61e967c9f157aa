// Draws curves on double logarithmic axes, as an SVG element.
#pragma once

#include <string>
#include <vector>

namespace halflight::converge {

/// A point with the interval of its y. The axes only show positive values.
struct Dot {
    double x = 0;     // x coordinate; <= 0: the point is left out
    double y = 0;     // y coordinate; <= 0: the point has a bar, but no marker
    double low = 0;   // lower end of the bar; <= 0: the axis
    double high = 0;  // upper end of the bar; <= 0 or infinite: no bar
};

struct Curve {
    std::string name;
    std::vector<Dot> dots;
};

struct Plot {
    std::string title;
    std::string x_label;  // quantity and unit
    std::string y_label;
    std::vector<Curve> curves;
    double guide = 0;  // slope of a dashed line for comparison; 0: none
};

/// Returns `text` for use in markup: & < > " ' become entities, characters that XML 1.0 forbids become U+FFFD.
std::string escape(const std::string& text);

/// Returns one <svg> element. Curves differ in colour and marker, so that they can be distinguished in print. An empty
/// plot contains a note.
std::string svg(const Plot& plot);

}  // namespace halflight::converge
