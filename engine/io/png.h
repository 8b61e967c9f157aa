// PNG files: written with 8 or 16 bits.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/core/display_encoding.h"
#include "engine/core/image.h"
#include "engine/io/image_header.h"
#include "engine/scene/scene.h"

namespace halflight {

/// Converts a display-encoded value in [0,1] to 8 bits, rounded to nearest; values outside are clamped, NaN becomes 0.
std::uint8_t quantize_8bit(float value);
std::vector<std::uint8_t> quantize_8bit(const Image& image);
std::uint16_t quantize_16bit(float value);  ///< Returns 16 bits in the same way.

/// A text of a PNG file (PNG, third edition, 11.3.3.2).
struct PngText {
    std::string keyword;  // 1 to 79 letters of Latin-1; empty: no text
    std::string text;     // text in Latin-1
};

/// What a PNG file has beside its size.
struct PngOptions {
    int bits = 8;  // bits of a channel: 8 or 16
    PngText text{};
    // How the values are encoded: if exact(), chunk cICP (PNG, third edition, 11.3.2.6) and, unless HDR, an ICC
    // profile. None: no tags; programs expect sRGB then.
    std::optional<DisplayEncoding> encoding{};
};

/// Encodes display-encoded values, rounded to nearest; values outside [0,1] are clamped, NaN becomes 0. Channels: 1
/// grey, 2 grey + alpha, 3 RGB, 4 RGB + straight alpha. Equal images give equal files. Throws Error with `subject`.
std::string encode_png(const std::string& subject, const Image& image, const PngOptions& options);

/// Encodes width * height * channels bytes, top row first, as above.
std::string encode_png(const std::string& subject, int width, int height, int channels,
                       const std::vector<std::uint8_t>& bytes, const PngText& text = {});

/// Writes the result of encode_png() to a file, which appears complete or not at all (files.h).
void write_png(const std::filesystem::path& path, int width, int height, int channels,
               const std::vector<std::uint8_t>& bytes);

/// Writes the quantized image.
void write_png(const std::filesystem::path& path, const Image& image);

bool is_png(std::string_view bytes);

/// Returns the first text (chunk tEXt) with this keyword; empty if there is none.
std::string text_of_png(std::string_view png, std::string_view keyword);

/// Reads the size of a PNG from its first bytes; `file_bytes` is the size of the whole file. Throws Error like
/// read_png().
ImageHeader read_png_header(const std::string& subject, std::string_view bytes, std::uint64_t file_bytes, int max_side);

/// Reads display-encoded values in [0,1] from 8 or 16 bits, with the channels of the file (palettes are resolved).
/// Ignores gamma and profiles. Throws Error with `subject` for damaged and truncated files, and for sides longer than
/// `max_side`.
Image read_png(const std::string& subject, std::string_view bytes, int max_side);

/// Reads RGBA; grey is expanded. 16 bits stay unless all values are multiples of 257, which 8 bits hold as well.
void read_png(const std::string& subject, std::string_view bytes, int max_side, TextureImage& image);

}  // namespace halflight
