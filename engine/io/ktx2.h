// Decoding of KTX2 files to texels (KTX File Format Specification 2.0): ETC1S with BasisLZ, UASTC and uncompressed
// 8-bit texels, the latter two with or without Zstandard. KHR_texture_basisu allows ETC1S and UASTC alone.
#pragma once

#include <string>
#include <string_view>

#include "engine/io/image_header.h"
#include "engine/scene/scene.h"

namespace halflight {

bool is_ktx2(std::string_view bytes);

/// Reads the size and the transfer function of a KTX2 from its first bytes; `file_bytes` is the size of the whole file.
/// Throws Error like read_ktx2().
ImageHeader read_ktx2_header(const std::string& subject, std::string_view bytes, std::uint64_t file_bytes,
                             int max_side);

/// Fills in size and texels of `image` from the largest mip level of a 2D texture. One channel is repeated in R, G and
/// B; two become R and G. Throws Error with `subject` for truncated and damaged files, other formats, arrays, cubes,
/// volumes, videos, swizzled, rotated and premultiplied texels, and for sizes that check_image_size() refuses.
void read_ktx2(const std::string& subject, std::string_view bytes, int max_side, TextureImage& image);

}  // namespace halflight
