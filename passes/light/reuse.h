// Path reuse across pixels: the light that a path finds beyond its second vertex is for all pixels of its group
// (Bekaert, Sbert, Halton 2002, Accelerating Path Tracing by Re-Using Paths; shaders/SHADING.md, Path reuse).
#pragma once

#include "engine/gpu/context.h"
#include "passes/light/continuation.h"
#include "passes/surface/gbuffer.h"

namespace halflight {

/// A ReusePoint for every path, which the continuation fills: PathBuffers::points.
graph::BufferHandle create_reuse_points(graph::Graph& graph, const SceneView& view);

/// After the continuation of `paths`, which have `points`: connects the first surfaces of each group of
/// SceneView::group_size pixels with the points of its paths by an any-hit ray for each member and point, and gathers
/// what each receives, by the balance heuristic over all that could have found the point, visibility included. Returns
/// DirectLight by path, by component of the receiver; all of it is indirect light, and none of it is in the states of
/// the paths.
graph::BufferHandle add_reuse(graph::Graph& graph, const SceneView& view, const GBuffer& gbuffer,
                              const PathBuffers& paths, const Continuation& continuation);

}  // namespace halflight
