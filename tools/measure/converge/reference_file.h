// References on disk: the sums of both halves, so that more samples can be added later.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>

#include "tools/measure/converge/picture.h"

namespace halflight::converge {

/// Two independent pictures: what one has is uncorrelated with the other's noise.
using Halves = std::array<PictureSums, 2>;

/// $XDG_CACHE_HOME/halflight/references, else ~/.cache/halflight/references (XDG Base Directory Specification). Throws
/// Error where neither variable is set.
std::filesystem::path default_reference_folder();

/// The file of this fingerprint in the folder.
std::filesystem::path reference_path(const std::filesystem::path& folder, std::uint64_t fingerprint);

/// Makes the folders that lead to it. Throws Error if save_halves() would, as far as that can be told beforehand.
void prepare_to_save(const std::filesystem::path& path);
/// Complete or not at all; makes the folders that lead to it. Throws Error.
void save_halves(const std::filesystem::path& path, std::uint64_t fingerprint, const Halves& halves);

/// Nothing where there is no such file. Throws Error for one that is damaged, of another fingerprint or another size.
std::optional<Halves> load_halves(const std::filesystem::path& path, std::uint64_t fingerprint, int width, int height);

}  // namespace halflight::converge
