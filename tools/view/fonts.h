// Fonts of the window.
#pragma once

#include <filesystem>
#include <optional>
#include <string_view>

namespace halflight::view {

/// Returns the file of DejaVu Sans, else of Noto Sans, in the font folders below `data_dirs`; none if neither is
/// installed. data_dirs: value of $XDG_DATA_DIRS, folders separated by colons; empty: its default.
std::optional<std::filesystem::path> find_font(std::string_view data_dirs);

/// Message for the user if find_font() finds nothing.
inline constexpr const char* kNoFont =
    "DejaVu Sans and Noto Sans are missing, so text does not scale well; Debian's package is fonts-dejavu-core";

}  // namespace halflight::view
