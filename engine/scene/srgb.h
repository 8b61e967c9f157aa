// Transfer function of sRGB.
#pragma once

#include <cmath>
#include <cstdint>

namespace halflight {

/// Decodes an sRGB value in [0, 1] to linear, [0, 1] (IEC 61966-2-1).
inline double srgb_to_linear(double v) {
    return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
}
/// Decodes an 8-bit sRGB value.
inline double srgb_to_linear(std::uint8_t value) {
    return srgb_to_linear(value / 255.0);
}
/// Encodes a linear value in [0, 1].
inline double linear_to_srgb(double v) {
    return v <= 0.0031308 ? 12.92 * v : 1.055 * std::pow(v, 1 / 2.4) - 0.055;
}

}  // namespace halflight
