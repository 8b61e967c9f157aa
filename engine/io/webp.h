// Decoding of WebP files to texels, by libwebp.
#pragma once

#include <string>
#include <string_view>

#include "engine/io/image_header.h"
#include "engine/scene/scene.h"

namespace halflight {

bool is_webp(std::string_view bytes);

/// Reads the size of a WebP from its first bytes; `file_bytes` is the size of the whole file. Throws Error like
/// read_webp().
ImageHeader read_webp_header(const std::string& subject, std::string_view bytes, std::uint64_t file_bytes,
                             int max_side);

/// Fills in size and texels of `image` from a lossy or lossless WebP; profiles are ignored. Throws Error with `subject`
/// for truncated, damaged and animated files, and for sizes that check_image_size() refuses.
void read_webp(const std::string& subject, std::string_view bytes, int max_side, TextureImage& image);

}  // namespace halflight
