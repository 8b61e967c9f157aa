// The user's caches: where they are, and how large they become.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string_view>

namespace halflight {

/// Returns $XDG_CACHE_HOME/halflight/`name`, else ~/.cache/halflight/`name`, or an empty path if neither variable is
/// set. A relative path in a variable counts as not set (XDG Base Directory Specification 0.8).
std::filesystem::path cache_folder(std::string_view name);

/// Deletes files of a cache, those written or used least recently first, until the others take at most `most` bytes. By
/// default that is half of what they and the free space of their disk take. Only regular files with the names of our
/// caches are counted and deleted: 16 hexadecimal digits, then more text that contains `kind`; `kept` is not deleted.
/// Files that other processes use or delete meanwhile are no error.
void trim_cache(const std::filesystem::path& folder, std::string_view kind, std::optional<std::uintmax_t> most = {},
                const std::filesystem::path& kept = {});

/// Returns an existing folder for large temporary files: $TMPDIR, else cache_folder("temporary"), which is created,
/// else the system's folder for temporary files. The last one may be in memory.
std::filesystem::path scratch_folder();

}  // namespace halflight
