// Doubles for numbers that are floats, as files and messages show them.
#pragma once

#include <charconv>
#include <iterator>

namespace halflight {

/// Returns the double of the fewest digits that is read as this float: 0.3, not 0.30000001192092896.
inline double short_number(float v) {
    char digits[32];
    double read = 0;
    std::from_chars(digits, std::to_chars(digits, std::end(digits), v).ptr, read);
    return static_cast<float>(read) == v ? read : double{v};
}

}  // namespace halflight
