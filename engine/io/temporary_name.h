// Names of the files that are made beside a file while it is written.
#pragma once

#include <filesystem>
#include <string>

namespace halflight {

/// Follows symbolic links from `path`; the last one may point to a file that does not exist. Throws Error for a loop.
std::filesystem::path follow_links(const std::filesystem::path& path);

/// Returns the prefix of the names of all files that are made beside `target`, in its folder, while it is written.
/// remove_abandoned() removes those that no process has locked.
std::string temporary_prefix(const std::filesystem::path& target);

/// Returns whether a file has the name of a temporary, of any target.
bool is_temporary(const std::filesystem::path& file);

}  // namespace halflight
