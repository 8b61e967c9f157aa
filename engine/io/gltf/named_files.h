// The files that a scene names, found without loading it.
#pragma once

#include <filesystem>
#include <vector>

namespace halflight {

/// Returns the file of a scene and the files that its JSON names: buffers, images, and the parts of a list with theirs.
/// They need not exist. The scene may be damaged or missing; names are then those that were found before the damage.
std::vector<std::filesystem::path> files_named_by(const std::filesystem::path& scene);

}  // namespace halflight
