// Equirectangular environment maps from OpenEXR (.exr) and Radiance (.hdr, .pic) files.
#pragma once

#include <filesystem>

#include "engine/io/exr.h"
#include "engine/scene/scene.h"

namespace halflight {

/// The map as it stands in the file, told apart by content, not by extension. What is mended is counted and said in
/// `report`: NaN and negative values become 0, infinities the map's largest finite value. EXR: R G B, or luminance (Y
/// or the only channel); other primaries than Rec.709 are converted. A map that is not 2:1 is stretched, with a
/// warning; an entirely black one gives a black environment without a map. Error: unreadable, damaged, truncated,
/// beyond the limits.
Environment load_environment(const std::filesystem::path& path, SceneReport& report, const ExrLimits& limits = {});

}  // namespace halflight
