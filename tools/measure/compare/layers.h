// Reads picture files as layers that can be compared.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "engine/core/chromaticities.h"
#include "engine/core/image.h"

namespace halflight::compare {

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
    Image image;
};

struct PictureFile {
    std::string name;  // path in the user's words
    int width = 0;
    int height = 0;
    bool encoded = false;  // display-encoded (PNG) instead of scene-linear (EXR, HDR)
    Chromaticities primaries = kRec709;
    std::vector<Layer> layers;  // layers without a name first, then sorted by name

    const Layer* find(const std::string& layer) const;  ///< Returns null where there is none.
};

/// Reads an EXR (all layers of the first part), PNG or Radiance HDR file, recognised by its content. Throws Error.
PictureFile read_picture(const std::filesystem::path& path);

}  // namespace halflight::compare
