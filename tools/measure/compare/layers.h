// Picture files as layers that can be compared.
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
    data,   // anything else
    ids,    // whole numbers, of which only equality tells anything: bits in place of values, as of ExrType::uint32
};

/// Channels that are one thing: "albedo" for albedo.R, albedo.G, albedo.B; "RGB" for those without a name, "Z", "A".
struct Layer {
    std::string name;
    std::vector<std::string> channels;  // as in the file
    LayerKind kind = LayerKind::data;
    Image image;
};

struct PictureFile {
    std::string name;  // as the user gave it
    int width = 0;
    int height = 0;
    bool encoded = false;  // for a display (PNG) rather than scene-linear (EXR, HDR)
    Chromaticities primaries = kRec709;
    std::vector<Layer> layers;  // those without a name first, then by name

    const Layer* find(const std::string& layer) const;  // null where there is none
};

/// EXR (all layers of the first part), PNG and Radiance HDR, told apart by content. Throws Error.
PictureFile read_picture(const std::filesystem::path& path);

}  // namespace halflight::compare
