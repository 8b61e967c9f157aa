// JPEG files, by libjpeg-turbo.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

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

/// Longest side of the JPEG files of libjpeg, pixels.
inline constexpr int kMostJpegSide = 65500;

/// Encodes width * height * 3 bytes, display-encoded, top row first. `profile`: an ICC profile; empty: none. Chroma is
/// not subsampled. quality: 1 to 100. comment: at most 65533 bytes; empty: none. Equal bytes give equal files. Throws
/// Error with `subject`, also for sides above kMostJpegSide.
std::string encode_jpeg(const std::string& subject, int width, int height, const std::vector<std::uint8_t>& rgb,
                        int quality, std::string_view comment = {}, std::string_view profile = {});

/// Returns the first comment of a JPEG; empty if there is none.
std::string comment_of_jpeg(std::string_view bytes);

}  // namespace halflight
