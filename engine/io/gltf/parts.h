// Scenes in several glTF files.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <vector>

#include "engine/io/files.h"
#include "engine/io/gltf/gltf.h"

namespace halflight {

/// Returns whether a path names a list of files.
bool is_part_list(const std::filesystem::path& path);

/// Returns the files of a scene: those that a list "NAME.parts.json" names, {"parts": [{"uri": "NAME.000.glb"}, ...]},
/// or else the path itself. The files lie in the folder of the list unless `options` allows others. Throws Error for a
/// list that is unreadable or malformed.
std::vector<std::filesystem::path> scene_parts(const std::filesystem::path& path, const GltfOptions& options = {});

/// Opens the files of a scene. Throws Error for a list of files whose animations change more than cameras.
std::vector<GltfScene> open_files(const std::filesystem::path& path, const GltfOptions& options = {});

/// Returns the sizes of all files together, without geometry but for the largest mesh and the triangles drawn.
SceneSize size_of_parts(std::span<GltfScene> parts);

/// Returns a number for the name of a scene's page file: a hash of sizes, starts and ends of the scene's files and
/// their buffers, without images. It does not depend on names. Scenes with equal numbers may differ (have_contents()).
std::uint64_t identity_of(std::span<const GltfScene> parts);

/// Returns the contents of the scene's files and their buffers, without images.
std::vector<FileContent> contents_of(std::span<const GltfScene> parts);
/// Returns whether the files still have these contents.
bool have_contents(std::span<const GltfScene> parts, std::span<const FileContent> contents);

/// Opens the scene of such files for reading mesh by mesh.
std::unique_ptr<MeshSource> open_parts(const std::filesystem::path& path, const GltfOptions& options = {});

}  // namespace halflight
