// The range of a number in a table of properties.
#pragma once

#include <limits>
#include <string>

namespace halflight {

/// Inclusive range of a property; an infinite bound admits every finite number on its side.
struct PropertyRange {
    float lowest = -std::numeric_limits<float>::infinity();
    float highest = std::numeric_limits<float>::infinity();
};

/// Returns why the value is invalid ("2 is outside [0, 1]"), or an empty text.
std::string range_error(const PropertyRange& range, float value);

}  // namespace halflight
