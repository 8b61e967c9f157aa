// Data of applications in the extras of glTF files.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>

#include "engine/core/frames.h"

namespace halflight {

class GltfWarnings;

/// Returns the frame rate for which a file was made. It is "fps" or "frame_rate" in the extras of the default scene,
/// else of the asset. Blender stores custom properties of a scene there. Values other than numbers from 0.001 to
/// 1000000 are ignored with a warning. `root` is an object, otherwise unchecked.
std::optional<FrameRate> frame_rate_in_extras(const nlohmann::json& root, GltfWarnings& warnings);

}  // namespace halflight
