// Transfer function of sRGB.
#pragma once

#include <cmath>
#include <cstdint>

namespace halflight {

/// Decodes an 8-bit sRGB value to linear, [0, 1] (IEC 61966-2-1).
inline double srgb_to_linear(std::uint8_t value) {
    const double v = value / 255.0;
    return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
}

}  // namespace halflight
