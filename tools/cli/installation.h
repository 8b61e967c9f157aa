// Files that are installed with the program.
#pragma once

#include <filesystem>

namespace halflight {

/// Returns the folder of the running program. Throws Error where /proc is missing, which tells it.
std::filesystem::path program_folder();

/// Returns the scene of `--demo`, of an installed program or of a build folder. Throws Error if it is missing.
std::filesystem::path demo_scene();

}  // namespace halflight
