// Declares the fuzz targets, for libFuzzer (driver.cpp) and for the test of former findings (test_regressions.cpp).
#pragma once

#include <stdexcept>
#include <string_view>

namespace halflight::fuzz {

/// Thrown if a guarantee about bad input does not hold.
struct Broken : std::logic_error {
    using std::logic_error::logic_error;
};

/// Loads arbitrary bytes, like the targets below. Bad input must throw an Error of one line that starts with the file's
/// name. Loaded data must be valid. Throws Broken otherwise.
void gltf(std::string_view input);
void draco(std::string_view input);    ///< Numbers of vertices and indices, 16 bits each, then data of Draco.
void meshopt(std::string_view input);  ///< Mode, filter and stride, a byte each, count of 16 bits, then meshopt data.
void environment(std::string_view input);  ///< Loads an OpenEXR or Radiance file.
void color(std::string_view input);        ///< Loads lines with display, view, look and colour space, then a config.
void arguments(std::string_view input);    ///< Parses a line with a list of frames, then the words of a command line.
void ies(std::string_view input);          ///< Reads a light profile.
void ktx2(std::string_view input);         ///< Decodes a KTX2 image.
void etc1s(std::string_view input);        ///< Decodes a KTX2 image as one in ETC1S.
void uastc(std::string_view input);        ///< Decodes a KTX2 image as one in UASTC.
void webp(std::string_view input);         ///< Decodes a WebP image.
/// Reads the index of a page file, table rows and pages, each decompressed and with its size of 32 bits before it.
void pages(std::string_view input);
void settings(std::string_view input);  ///< Parses the contents of a settings file.
/// Parses the contents of a settings file, and applies its edits to a small scene.
void edits(std::string_view input);

}  // namespace halflight::fuzz
