// Decoding of UASTC, the block-compressed texture format of KTX2 (Khronos Data Format Specification 1.4, chapter 25).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace halflight {

inline constexpr std::size_t kUastcBlockBytes = 16;

/// RGBA of 4 x 4 texels, row-major, top row first.
using TexelBlock = std::array<std::uint8_t, 64>;

/// Decodes the kUastcBlockBytes bytes of a block. srgb: the values are sRGB-encoded, which decides how they are
/// rounded. Returns false for a reserved mode and for a partition pattern that does not exist.
bool decode_uastc(const std::uint8_t* bytes, bool srgb, TexelBlock& texels);

}  // namespace halflight
