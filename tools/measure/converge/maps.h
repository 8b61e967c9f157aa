// Makes small, display-encoded pictures for the page.
#pragma once

#include <string>

#include "engine/core/image.h"

namespace halflight::converge {

/// Returns means of n x n pixels. n is the smallest number for which neither side is longer than `side`. Incomplete
/// blocks at the right and lower edge are cut off.
Image shrink(const Image& image, int side);

/// Returns the difference of luminance as colours, with full saturation at +-scale. Red: the image is brighter than the
/// reference; blue: it is darker; white: both are equal. 3 channels, display-encoded.
Image signed_error_picture(const Image& image, const Image& reference, double scale);
/// Returns the absolute luminance error that `share` of the pixels do not exceed; > 0.
double error_scale(const Image& image, const Image& reference, double share = 0.99);

/// Returns "data:image/png;base64,...", for the src of an <img>.
std::string data_uri(const Image& display_encoded);

std::string base64(const std::string& bytes);  ///< Encodes by RFC 4648, section 4.

}  // namespace halflight::converge
