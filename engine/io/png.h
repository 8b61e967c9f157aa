// 8-bit PNG files.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "engine/core/image.h"
#include "engine/scene/scene.h"

namespace halflight {

/// Display-encoded [0,1] to 8 bits, rounded to nearest; values outside are clamped, NaN is 0.
std::uint8_t quantize_8bit(float value);
std::vector<std::uint8_t> quantize_8bit(const Image& image);

/// Of a file, beside its pixels (PNG, third edition, 11.3.3.2).
struct PngText {
    std::string keyword;  // 1 to 79 letters of Latin-1; empty: there is none
    std::string text;     // Latin-1
};

/// `bytes`: width * height * channels, top row first, display-encoded (sRGB unless told otherwise by the file's user);
/// channels: 1 grey, 2 grey + alpha, 3 RGB, 4 RGB + straight alpha. The same bytes give the same file.
/// Throws Error that names `subject`.
std::string encode_png(const std::string& subject, int width, int height, int channels,
                       const std::vector<std::uint8_t>& bytes, const PngText& text = {});

/// encode_png() as a file, which is there complete or not at all (files.h).
void write_png(const std::filesystem::path& path, int width, int height, int channels,
               const std::vector<std::uint8_t>& bytes);

/// write_png() of the quantized image.
void write_png(const std::filesystem::path& path, const Image& image);

bool is_png(std::string_view bytes);

/// The first text (chunk tEXt) of this keyword; empty where there is none.
std::string text_of_png(std::string_view png, std::string_view keyword);

/// Display-encoded [0,1] of 8 or 16 bits, as many channels as the file has (palettes are resolved). Error, naming
/// `subject`: damaged, truncated, beyond `max_side` pixels. Gamma and profiles are not looked at.
Image read_png(const std::string& subject, std::string_view bytes, int max_side);

/// The same as 8-bit RGBA: 16 bits are cut to 8, grey is spread.
void read_png(const std::string& subject, std::string_view bytes, int max_side, TextureImage& image);

}  // namespace halflight
