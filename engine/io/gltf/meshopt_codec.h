// What KHR_meshopt_compression adds to EXT_meshopt_compression, and the libraries of Debian 12 lack: version 1 of the
// codec of attributes (appendix A of the extension, mode 0), and the filter of colours (appendix B, filter 4).
#pragma once

#include <cstddef>
#include <span>
#include <string_view>

namespace halflight {

inline constexpr unsigned char kMeshoptAttributes1 = 0xa1;  ///< first byte of attributes of version 1

/// Decodes elements of `stride` bytes, a multiple of 4 up to 256. Returns whether the data were whole and valid.
bool decode_meshopt_attributes(std::span<char> elements, std::size_t stride, std::string_view data);

/// Converts colours of four components, with a stride of 4 or 8 bytes, from YCoCg to RGB, in place.
void decode_meshopt_colors(std::span<char> elements, std::size_t stride);

}  // namespace halflight
