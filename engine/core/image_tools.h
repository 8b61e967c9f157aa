// What is done to images now and then.
#pragma once

#include "engine/core/image.h"

namespace halflight {

/// The first three channels of an image that has them: without alpha, which over black is what every viewer shows.
Image rgb(const Image& rgba);

/// Of the same size and channels, every value bit for bit.
bool same_bits(const Image& a, const Image& b);

/// Each pixel's mean with its neighbours in a square of (2 radius + 1)^2 pixels; at the border, with those that there
/// are.
Image box_blur(const Image& image, int radius);

}  // namespace halflight
