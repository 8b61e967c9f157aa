// What applications keep in the extras of a glTF and that matters here.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>

#include "engine/core/frames.h"

namespace halflight {

class GltfWarnings;

/// The frame rate that a file was made for, about which glTF says nothing: "fps" or "frame_rate" in the extras of the
/// scene that is shown (where Blender puts a scene's custom properties), else in those of the asset. What is no number
/// from 0.001 to 1000000 is passed over with a warning. `root` is an object, otherwise unchecked.
std::optional<FrameRate> frame_rate_in_extras(const nlohmann::json& root, GltfWarnings& warnings);

}  // namespace halflight
