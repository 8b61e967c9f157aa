// Files of references: the sums of both halves, to which samples can be added later.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>

#include "tools/measure/converge/picture.h"

namespace halflight::converge {

/// Two independent pictures, whose noise is uncorrelated.
using Halves = std::array<PictureSums, 2>;

/// Returns $XDG_CACHE_HOME/halflight/references or ~/.cache/halflight/references (XDG Base Directory Specification).
/// Throws Error if neither XDG_CACHE_HOME nor HOME is set.
std::filesystem::path default_reference_folder();

/// Returns the file of this fingerprint in the folder.
std::filesystem::path reference_path(const std::filesystem::path& folder, std::uint64_t fingerprint);

/// Creates the folders of the path. Throws Error if save_halves() is certain to fail.
void prepare_to_save(const std::filesystem::path& path);
/// Writes the file, complete or not at all, and creates its folders. Throws Error.
void save_halves(const std::filesystem::path& path, std::uint64_t fingerprint, const Halves& halves);

/// Returns the halves; none if there is no such file. Throws Error for a file that is damaged, or has another
/// fingerprint or size.
std::optional<Halves> load_halves(const std::filesystem::path& path, std::uint64_t fingerprint, int width, int height);

}  // namespace halflight::converge
