// Lights with a size that scattered rays meet (SHADING.md, Lights with a size).
//
// Points, spots and directional lights with a size are seen by light samples and by scattered rays, weighted by the
// power heuristic. They hide nothing, so no tracer knows them. Camera rays do not see them.
#pragma once

#include "passes/steps/paths.h"

namespace halflight {

/// Finds the light that the rays of a batch with a list meet before their hits; makes PathBuffers::met_lamps. Adds
/// nothing to scenes without such lights. Precondition: `paths` has the throughput of the rays before any pane.
void add_met_lamps(graph::Graph& graph, const SceneView& view, const rays::RayBatch& batch, PathBuffers& paths);

}  // namespace halflight
