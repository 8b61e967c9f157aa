// Edits that scenes in pages cannot follow.
#pragma once

#include <string>
#include <vector>

#include "api/halflight/scene_edits.h"

namespace halflight {

namespace paging {
struct PageIndex;
}

/// Throws the Error of check_no_moved_surfaces(). Throws Error about the scene, or about `source`, if edits let alpha
/// decide hits on surfaces that the pages hold as opaque. `scene` is the scene before edits. `driven` tells for each
/// material whether animations change it, so that its alpha decides hits anyway; it may be shorter.
void check_paged_edits(const SceneEdits& edits, const Scene& scene, const paging::PageIndex& index,
                       const std::string& file, const std::string& source = {}, const std::vector<bool>& driven = {});

/// Throws Error about `file` if edits move, hide or add surfaces.
void check_no_moved_surfaces(const SceneEdits& edits, const std::string& file);

}  // namespace halflight
