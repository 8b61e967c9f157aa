// Curves on double logarithmic axes, as SVG that stands by itself or within a page.
#pragma once

#include <string>
#include <vector>

namespace halflight::converge {

/// A point with the interval of its y; what is not positive has no place on the axes.
struct Dot {
    double x = 0;     // > 0, otherwise the point is left out
    double y = 0;     // <= 0: no marker, but the bar
    double low = 0;   // <= 0: the bar goes down to the axis
    double high = 0;  // <= 0 or infinite: there is no bar
};

struct Curve {
    std::string name;
    std::vector<Dot> dots;
};

struct Plot {
    std::string title;
    std::string x_label;  // with unit
    std::string y_label;
    std::vector<Curve> curves;
    double guide = 0;  // slope of a dashed line to compare with; 0: none
};

/// `text` where markup is not meant: & < > " ' as entities, and what XML 1.0 does not allow as U+FFFD.
std::string escape(const std::string& text);

/// One <svg> element. Curves are told apart by colour and by marker, so that they are in print as well. Without
/// anything to show it says so.
std::string svg(const Plot& plot);

}  // namespace halflight::converge
