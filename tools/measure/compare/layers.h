// Reads picture files as layers that can be compared.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "engine/core/chromaticities.h"
#include "engine/core/error.h"
#include "engine/core/image.h"
#include "engine/core/math.h"
#include "engine/io/exr.h"

namespace halflight::compare {

class SizesDiffer : public Error {
  public:
    using Error::Error;
};

enum class LayerKind {
    color,  // R, G, B
    data,   // any other values
    ids,    // whole numbers, compared for equality only; the image's floats hold their bits (ExrType::uint32)
};

/// Channels that belong together: "albedo" for albedo.R, albedo.G, albedo.B; "RGB", "Z" or "A" for channels without a
/// layer name.
struct Layer {
    std::string name;
    std::vector<std::string> channels;  // names in the file
    LayerKind kind = LayerKind::data;
    bool whole_numbers = false;  // the pixels are the bits of UINT channels
    Image image;
    ivec2 origin{0};  // upper left pixel of the image in the display window
};

struct PictureFile {
    std::string name;  // path in the user's words
    int width = 0;     // width of the data window of the picture's part, pixels; layers may have others
    int height = 0;
    ivec2 origin{0};                      // upper left pixel of the data window in the display window
    std::optional<ivec2> display;         // size of the display window, pixels; none: the format has no windows
    ExrWindow own{};                      // data window before align()
    std::vector<std::string> deep_parts;  // ExrFile::deep_parts
    bool encoded = false;                 // display-encoded (PNG) instead of scene-linear (EXR, HDR)
    Chromaticities primaries = kRec709;
    std::vector<Layer> layers;  // layers without a name first, then sorted by name

    const Layer* find(const std::string& layer) const;  ///< Returns null if there is none.
};

/// Gives both pictures, and each layer that both have, the data window that contains those of both. Missing
/// pixels are 0. A picture without windows has those of the other one if its size is that of the other's data window.
/// Returns a line about data windows that differ; empty: they do not. Throws SizesDiffer if the display windows have
/// different sizes.
std::string align(PictureFile& image, PictureFile& reference);

/// Reads an EXR (the layers of all flat parts), PNG, JPEG, TIFF or Radiance file, recognised by its content. Throws
/// Error.
PictureFile read_picture(const std::filesystem::path& path);

}  // namespace halflight::compare
