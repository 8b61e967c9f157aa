// Page files of scenes that do not fit into memory, in the user's cache.
#pragma once

#include <filesystem>
#include <memory>
#include <span>

#include "api/halflight/log.h"
#include "api/halflight/pack.h"
#include "engine/io/gltf/gltf.h"
#include "engine/paging/page_file.h"

namespace halflight {

/// Returns the page file of a scene in the folder $XDG_CACHE_HOME/halflight/scenes. If it is missing, damaged or
/// made of other contents, the scene is converted, which the log notes. `parts` are the scene's files. The folder takes
/// at most half of the space that its disk has for it; files used least recently are deleted first. Throws Error like
/// pack_scene(), and if there is no such folder. A page of the file that turns out to be damaged removes the file.
std::shared_ptr<paging::PageFile> cached_pages(const std::filesystem::path& scene, std::span<const GltfScene> parts,
                                               const PackOptions& options, const Log& log);

}  // namespace halflight
