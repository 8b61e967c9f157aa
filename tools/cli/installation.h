// Files that are installed with the program.
#pragma once

#include <filesystem>

namespace halflight {

/// Returns the folder of the running program. Throws Error if /proc is missing.
std::filesystem::path program_folder();

/// Returns the scene of `--demo`, of an installed program or of a build folder. Throws Error if it is missing.
std::filesystem::path demo_scene();

/// Returns the file in which the viewer keeps its settings of a scene: beside the scene, and for a scene that is installed
/// with the program in the current folder.
std::filesystem::path settings_file_for(const std::filesystem::path& scene);

}  // namespace halflight
