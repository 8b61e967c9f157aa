// The kinds of files that are often taken for others, by their first bytes.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string_view>

namespace halflight {

inline constexpr std::string_view kPageFileKind = "a page file of Halflight";

/// Returns the kind of a file, "a Blender file", or an empty text for an unknown one. start: the first bytes of the
/// file; 4096 are enough. file_bytes: the size of the whole file.
std::string_view kind_of_file(std::string_view start, std::uint64_t file_bytes);

/// Throws Error that names the file if a log or another text must not be written to it. Such files exist already, and
/// have bytes of zero, as pictures, buffers and .glb files have, or are .gltf files.
void check_takes_text(const std::filesystem::path& path);

}  // namespace halflight
