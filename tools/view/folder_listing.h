// Folders and files that the file dialog offers. Uses no window.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace halflight::view {

struct FolderEntry {
    std::string name;  // name without its folder
    bool folder = false;
    bool operator==(const FolderEntry&) const = default;
};

/// Returns the folders in a folder and its files with one of the extensions, both sorted by name, folders first. Names
/// that begin with a point are left out. extensions: without a point. Throws Error if the folder cannot be read.
std::vector<FolderEntry> list_folder(const std::filesystem::path& folder, std::span<const std::string_view> extensions);

/// Returns the path of a typed name: absolute, below the home folder after "~/", else in `folder`.
std::filesystem::path typed_path(const std::filesystem::path& folder, std::string_view name);

}  // namespace halflight::view
