// TIFF files of one picture, by libtiff.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "engine/core/chromaticities.h"
#include "engine/core/image.h"

namespace halflight {

/// Values of a TIFF file: integers of 8 or 16 bits for [0,1], or floats.
enum class TiffType : std::uint8_t { uint8, uint16, float32 };

/// Encodes an image of 1 to 4 channels, top row first: grey, grey + alpha, RGB, RGB + alpha. Alpha of integers is
/// straight, that of floats is premultiplied. Integers are rounded to nearest; values outside [0,1] are clamped, NaN
/// becomes 0. The data are compressed without loss (Deflate). `description` becomes the tag ImageDescription unless it
/// is empty, and `primaries` the tags WhitePoint and PrimaryChromaticities (TIFF 6.0, section 20) unless some
/// coordinate is negative, which these cannot hold. `profile` becomes the ICC profile unless it is empty. Equal images
/// give equal files. Throws Error with `subject`.
std::string encode_tiff(const std::string& subject, const Image& image, TiffType type,
                        const std::string& description = "", const std::optional<Chromaticities>& primaries = {},
                        const std::string& profile = "");

bool is_tiff(std::string_view bytes);

struct TiffFile {
    Image image;                                // integers as values in [0,1]
    TiffType type{};                            // values of the file
    std::string description;                    // tag ImageDescription; empty if there is none
    std::optional<Chromaticities> primaries{};  // tags WhitePoint and PrimaryChromaticities; none without both
};
/// Reads files of strips with the channels of a pixel together, like those of encode_tiff(). Throws Error with
/// `subject` for others, for damaged files, and for sides longer than `max_side`.
TiffFile read_tiff(const std::string& subject, std::string_view bytes, int max_side);

}  // namespace halflight
