#include "engine/io/image_header.h"

#include <utility>

#include "engine/core/error.h"

namespace halflight {

void check_image_size(const std::string& subject, const ImageHeader& header, std::uint64_t file_bytes, int max_side) {
    constexpr std::size_t kAlwaysAllowed = std::size_t{4096} * 4096;  // texels
    constexpr std::size_t kTexelsPerByte = 8 * 1032;                  // equals that of png_read.cpp
    const auto [width, height] = std::pair(header.width, header.height);
    if (width < 1 || height < 1) throw Error(subject, "has no texels");
    if (width > static_cast<std::size_t>(max_side) || height > static_cast<std::size_t>(max_side))
        throw Error(subject, "{} x {} texels are more than {} a side", width, height, max_side);
    if (width * height > kAlwaysAllowed && width * height / kTexelsPerByte > file_bytes)
        throw Error(subject, "is refused: {} bytes claim {} x {} texels", file_bytes, width, height);
}

}  // namespace halflight
