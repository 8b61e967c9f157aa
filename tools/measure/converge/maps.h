// Pictures for the page: small, display-encoded.
#pragma once

#include <string>

#include "engine/core/image.h"

namespace halflight::converge {

/// Means of n x n pixels, n the smallest whole number that makes the picture no wider and no higher than `side`; what
/// is left over at the right and lower edge is cut off.
Image shrink(const Image& image, int side);

/// Red where the image is brighter than the reference (by luminance), blue where it is darker, white where they are the
/// same; full colour at +-scale. 3 channels, display-encoded.
Image signed_error_picture(const Image& image, const Image& reference, double scale);
/// The absolute luminance error that this share of the pixels does not exceed; never 0.
double error_scale(const Image& image, const Image& reference, double share = 0.99);

/// "data:image/png;base64,...", for the src of an <img>.
std::string data_uri(const Image& display_encoded);

std::string base64(const std::string& bytes);  ///< RFC 4648, section 4

}  // namespace halflight::converge
