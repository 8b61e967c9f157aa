// Page files of scenes that do not fit into memory, in the user's cache.
#pragma once

#include <cstdint>
#include <filesystem>

#include "api/halflight/log.h"
#include "api/halflight/pack.h"

namespace halflight {

/// Returns the page file of a scene in the folder $XDG_CACHE_HOME/halflight/scenes. Where it is missing or damaged, the
/// scene is converted, which the log notes. `identity` is identity_of() the scene's files. The folder takes at most
/// half of the space that its disk has for it; files used least recently are deleted first. Throws Error like
/// pack_scene(), and where there is no such folder.
std::filesystem::path cached_pages(const std::filesystem::path& scene, std::uint64_t identity,
                                   const PackOptions& options, const Log& log);

}  // namespace halflight
