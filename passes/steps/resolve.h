// Surface records at the hits of paths.
#pragma once

#include "passes/steps/paths.h"

namespace halflight {

struct ResolveOptions {
    bool last = false;          // makes only emission and geometric normal
    bool by_chance = false;     // rays have met or passed panes by chance (passes/steps/panes.h)
    bool reuse_points = false;  // also makes PathBuffers::points, for path reuse
};
/// Makes the surface records of the hits of the paths in `list`. name: the pass.
graph::BufferHandle add_resolve(graph::Graph& graph, const SceneView& view, const char* name, const PathList& list,
                                PathBuffers& paths, const ResolveOptions& options = {});

}  // namespace halflight
