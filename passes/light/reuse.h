// Path reuse across pixels: all pixels of a group share the light that their paths find beyond the second vertex
// (Bekaert, Sbert, Halton 2002, Accelerating Path Tracing by Re-Using Paths; shaders/SHADING.md, Path reuse).
#pragma once

#include "engine/gpu/context.h"
#include "passes/steps/light_answers.h"
#include "passes/steps/paths.h"
#include "passes/steps/surfaces.h"

namespace halflight {

/// Creates PathBuffers::points for path reuse: a ReusePoint per path, filled by the continuation.
graph::BufferHandle create_reuse_points(graph::Graph& graph, const SceneView& view);

/// Adds path reuse after the continuation of `paths`, which have `points`. Connects the first surfaces of each group of
/// `group_size` pixels with the points of its paths, by one any-hit ray for each member and point. Gathers the
/// light that each member receives, weighted by the balance heuristic over all members that could have found the point,
/// visibility included. Returns a DirectLight per path, by component of the receiver. All of it is indirect light that
/// the states of the paths do not contain.
graph::BufferHandle add_reuse(graph::Graph& graph, const SceneView& view, const GBuffer& gbuffer,
                              const PathBuffers& paths, const Continuation& continuation, std::uint32_t group_size);

}  // namespace halflight
