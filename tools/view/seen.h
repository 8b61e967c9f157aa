// What of a picture is looked at, and how data that is no colour is shown.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "passes/render.h"

namespace halflight::view {

inline constexpr const char* kFinal = "final";

/// "final" and the names of known_aovs().
std::vector<std::string> views();
/// AOVs that the picture must be rendered with for this view.
std::vector<std::string> aovs_of(const std::string& view);
/// One line for people.
std::string description(const std::string& view);

/// An image of 3 channels at least, as it goes to the display.
struct Seen {
    Image image;
    bool encoded = false;  // for the display; otherwise linear Rec.709, which exposure and view transform come upon
};

/// Of a picture with the AOVs of the view. Radiance and albedo are colour. Of data: normals and motion as colour around
/// grey; position as colour between the corners of what is seen; ids as a colour each; depth, variance (as the relative
/// error of a pixel) and counts on magma's scale up to their 99th percentile.
Seen seen(const std::string& view, const RenderResult& result);

}  // namespace halflight::view
