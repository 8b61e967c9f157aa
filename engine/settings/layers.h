// The table of layers that a picture can have beside its colour.
#pragma once

#include <span>
#include <string_view>

namespace halflight {

/// An arbitrary output variable that can be asked for by name.
struct AovInfo {
    std::string_view name;         // EXR layer ("albedo", "depth")
    std::string_view channels;     // after the layer's name ("RGB", "XYZ", "Z")
    std::string_view description;  // one line with units
    bool debug = false;            // tells how the picture was made, not what it shows; may differ from run to run
    bool at_centre = false;        // of the ray through the pixel's centre alone: has no mean over samples or times
    bool at_any_time = false;      // made of what all samples leave behind: can still be asked for after them
};
/// Returns the layer of that name among known_aovs(); null for others.
const AovInfo* find_aov(std::string_view name);
/// Layers for debugging come last.
std::span<const AovInfo> known_aovs();

}  // namespace halflight
