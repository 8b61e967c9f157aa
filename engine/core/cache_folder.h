// The location of the user's caches.
#pragma once

#include <filesystem>
#include <string_view>

namespace halflight {

/// Returns $XDG_CACHE_HOME/halflight/`name`, else ~/.cache/halflight/`name`, or an empty path where neither variable is
/// set. A relative path in a variable counts as not set (XDG Base Directory Specification 0.8).
std::filesystem::path cache_folder(std::string_view name);

/// Returns an existing folder for large temporary files: $TMPDIR, else cache_folder("temporary"), which is created,
/// else the system's folder for temporary files. The last one may be in memory.
std::filesystem::path scratch_folder();

}  // namespace halflight
