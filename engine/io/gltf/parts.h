// Scenes in several glTF files.
#pragma once

#include <filesystem>
#include <memory>
#include <vector>

#include "engine/io/gltf/gltf.h"

namespace halflight {

/// Returns the files of a scene: those that a list "NAME.parts.json" names, {"parts": [{"uri": "NAME.000.glb"}, ...]},
/// or else the path itself. The files lie in the folder of the list unless `options` allows others. Throws Error for a
/// list that is unreadable or malformed.
std::vector<std::filesystem::path> scene_parts(const std::filesystem::path& path, const GltfOptions& options = {});

/// Opens the scene of such files for reading mesh by mesh.
std::unique_ptr<MeshSource> open_parts(const std::filesystem::path& path, const GltfOptions& options = {});

}  // namespace halflight
