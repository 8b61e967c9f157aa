// Lights with a size that scattered rays meet (SHADING.md, Lights with a size).
//
// Points, spots and directional lights with a size are seen by light samples and by scattered rays, weighted by the
// power heuristic. They hide nothing, so no tracer knows them. Camera rays see them with --show-lamps.
#pragma once

#include "passes/steps/paths.h"
#include "passes/steps/surfaces.h"

namespace halflight {

/// Finds the light that the rays of a batch with a list meet before their hits; makes PathBuffers::met_lamps. Adds
/// nothing to scenes without such lights. Precondition: `paths` has the throughput of the rays before any pane.
void add_met_lamps(graph::Graph& graph, const SceneView& view, const rays::RayBatch& batch, PathBuffers& paths);

/// Adds the light of lamps that camera rays meet before their hits, times `weight`, to a vec4 per path and light group
/// (SampleInputs::lamps). W is the share of rays that meet lamps in front of no surface. seen: the mean of earlier rays
/// and their light; empty: it begins here. visible: has rays and hits, found with the frame constants of `view`.
graph::BufferHandle add_shown_lamps(graph::Graph& graph, const SceneView& view, const GBuffer& visible,
                                    graph::BufferHandle seen = {}, float weight = 1);

}  // namespace halflight
