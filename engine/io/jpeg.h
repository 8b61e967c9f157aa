// Decoding of JPEG files to texels, by libjpeg-turbo.
#pragma once

#include <string>
#include <string_view>

#include "engine/io/image_header.h"
#include "engine/scene/scene.h"

namespace halflight {

bool is_jpeg(std::string_view bytes);

/// Reads the size of a JPEG from its first bytes; `file_bytes` is the size of the whole file. Throws Error like
/// read_jpeg().
ImageHeader read_jpeg_header(const std::string& subject, std::string_view bytes, std::uint64_t file_bytes,
                             int max_side);

/// Fills in size and texels of `image` from a grey or colour JPEG; profiles are ignored. Throws Error with `subject`
/// for truncated, damaged and CMYK files, and for sides longer than `max_side`.
void read_jpeg(const std::string& subject, std::string_view bytes, int max_side, TextureImage& image);

}  // namespace halflight
