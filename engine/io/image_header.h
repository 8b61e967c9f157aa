// The size of an encoded image.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace halflight {

struct ImageHeader {
    std::size_t width = 0, height = 0;  // texels
    std::size_t decoding_bytes = 0;     // bytes that decoding takes besides the texels and the file
    bool deep = false;                  // TextureImage::deep, unless the low bits turn out to be unused
    std::optional<bool> srgb{};  // whether the file says that its colours are sRGB-encoded; none: it does not say
    // Names of the file's colour primaries and transfer function if glTF does not allow them; empty otherwise.
    std::string_view primaries{}, transfer{};

    /// Returns the bytes of the texels.
    std::size_t texels_bytes() const { return (deep ? 8 : 4) * width * height; }
};

/// Checks the size of an image whose format lets a few bytes hold any number of equal texels. Throws Error with
/// `subject` for sides of 0 texels or more than `max_side`. Images of more than 4096 x 4096 texels are refused, too,
/// if `file_bytes` hold more texels each than those of the most compressed PNG.
void check_image_size(const std::string& subject, const ImageHeader& header, std::uint64_t file_bytes, int max_side);

}  // namespace halflight
