// Selects the animations that play.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "api/halflight/log.h"
#include "engine/io/gltf/gltf.h"

namespace halflight {

/// Returns indices into GltfScene::animations(). wanted: as SceneChoice::animation. The log names ignored channels and
/// animations that drive the same properties. Throws Error for damaged animations, and for unknown names (the error
/// lists those of the file).
std::vector<std::size_t> choose_animations(GltfScene& scene, const std::filesystem::path& file,
                                           const std::string& wanted, const Log& log);

}  // namespace halflight
