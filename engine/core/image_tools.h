// Small operations on images.
#pragma once

#include "engine/core/image.h"

namespace halflight {

/// Returns the first three channels of an image with at least three. Alpha is dropped, so the picture is over black.
Image rgb(const Image& rgba);

/// Returns whether both images have equal size, channels and bits.
bool same_bits(const Image& a, const Image& b);

/// Returns the mean of each pixel's square neighbourhood of (2 radius + 1)^2 pixels. At the border, only pixels inside
/// the image count.
Image box_blur(const Image& image, int radius);

}  // namespace halflight
