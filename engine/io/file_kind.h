// The kinds of files that are often taken for scenes or textures, by their first bytes.
#pragma once

#include <cstdint>
#include <string_view>

namespace halflight {

inline constexpr std::string_view kPageFileKind = "a page file of Halflight";

/// Returns the kind of a file, "a Blender file", or an empty text for an unknown one. start: the first bytes of the
/// file; 4096 are enough. file_bytes: the size of the whole file.
std::string_view kind_of_file(std::string_view start, std::uint64_t file_bytes);

}  // namespace halflight
