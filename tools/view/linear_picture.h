// Pictures of files that the viewer compares with its own.
#pragma once

#include <filesystem>

#include "engine/core/image.h"

namespace halflight::view {

/// Reads the channels R, G and B of an .exr as linear Rec.709, from the primaries that the file names. The picture is
/// that of the display window; missing pixels are black. Throws Error for files without these channels, and if the
/// primaries span no colours.
Image read_linear(const std::filesystem::path& path);

}  // namespace halflight::view
