// Where a user's caches are.
#pragma once

#include <filesystem>
#include <string_view>

namespace halflight {

/// $XDG_CACHE_HOME/halflight/`name`, else ~/.cache/halflight/`name` (XDG Base Directory Specification 0.8, by which
/// relative paths count as not set); empty where neither is set.
std::filesystem::path cache_folder(std::string_view name);

}  // namespace halflight
