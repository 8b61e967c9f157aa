// Small operations on images.
#pragma once

#include "engine/core/image.h"
#include "engine/core/math.h"

namespace halflight {

/// Returns the first three channels of an image with at least three. Alpha is dropped, so the picture is over black.
Image rgb(const Image& rgba);

/// Returns the pixels [first, first + size) of an image, which must have them.
Image part_of(const Image& image, const ivec2& first, const ivec2& size);

/// Returns an image of `size` pixels that shows `image` with its upper left pixel at `at`. What is beyond the edges is
/// left out, and missing pixels are 0.
Image placed(const Image& image, const ivec2& at, const ivec2& size);

/// Divides the colours of an image of four channels, which are premultiplied by alpha, by alpha. If that is 0, they
/// become 0.
Image straight(Image premultiplied);

/// Returns whether both images have equal size, channels and bits.
bool same_bits(const Image& a, const Image& b);

/// Returns the mean of each pixel's square neighbourhood of (2 radius + 1)^2 pixels. At the border, only pixels inside
/// the image count.
Image box_blur(const Image& image, int radius);

}  // namespace halflight
