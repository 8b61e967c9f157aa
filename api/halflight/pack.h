// Conversion of scenes that are larger than memory to page files.
#pragma once

#include <filesystem>
#include <functional>

#include "api/halflight/log.h"
#include "engine/paging/page_file.h"

namespace halflight {

struct PackOptions {
    bool allow_outside = false;                    // lets the scene name files outside its folder
    bool strict = false;                           // refuses scenes that break glTF, or whose images cannot be read
    bool straight_glass = false;                   // makes pages for SceneEdits::straight_glass
    std::function<void(double share)> progress{};  // called with the share of the work done; may throw to stop
};

/// Converts a scene to a page file, within the memory budget (MemoryLedger::process()). Geometry that some animation
/// moves or deforms is left out; renderers read it from the scene. The scene is a glTF
/// file or a list of such files, NAME.parts.json. The log gets the warnings of the loader. The file is written
/// completely or not at all. Throws Error that names file and element:
///   - what loading throws,
///   - a list of files with animations of more than cameras,
///   - textures, or a mesh, for which the memory budget has too little left,
///   - an `output` that exists and is no page file,
///   - a full disk.
paging::PageFileSizes pack_scene(const std::filesystem::path& scene, const std::filesystem::path& output,
                                 const PackOptions& options = {}, const Log& log = {});

}  // namespace halflight
