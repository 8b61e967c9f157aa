// Which animations of a file play.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "engine/core/frames.h"
#include "engine/io/gltf/gltf.h"
#include "tools/halflight/console.h"

namespace halflight {

/// Indices into GltfScene::animations(). wanted: a name, which comes first since a name may be a number; a number from
/// 0; "all" or "none". What animations leave out, and that some drive the same things, is said on the console. Throws
/// Error: damaged animations, and one that there is not (the error lists those that there are).
std::vector<std::size_t> choose_animations(GltfScene& scene, const std::filesystem::path& file,
                                           const std::string& wanted, const Console& console);

/// That which is asked for, else that of the file's extras, which is said on the console, else 24 a second.
FrameRate choose_frame_rate(const std::optional<FrameRate>& asked, const GltfScene& scene, const Console& console);

/// Whether light may come later where there is none at 0 s.
bool drive_light(GltfScene& scene, GltfScene::Playing playing);

}  // namespace halflight
