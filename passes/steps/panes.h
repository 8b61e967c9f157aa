// Rays through panes: surfaces that let light pass straight on (SHADING.md, Panes).
//
// Light that passes a pane straight on is no vertex of a path. Shadow rays pass all panes, and their light is
// multiplied by what these let pass. Scattered rays pass each pane by chance, and their throughput follows. If they
// do not pass, the pane is their hit, a surface with its other lobes alone. The light of each path is counted once,
// with the densities of the vertices before and behind the panes. Camera rays, connections of path reuse and specular
// chains meet panes like other surfaces. Without panes in the scene, only the batch is traced.
#pragma once

#include "passes/steps/paths.h"

namespace halflight {

/// Traces shadow rays by any_hit(). The answers of free rays through panes then have the light that these let pass
/// (shaders/lib/occlusion.glsl).
graph::BufferHandle trace_shadow_rays(graph::Graph& graph, const SceneView& view, const rays::RayBatch& batch,
                                      graph::BufferHandle answers);

/// Traces the scattered rays of a batch with a list by closest_hit(), and updates `hits` and the throughput in `states`
/// of `paths`. Also finds the lights with a size that they meet (passes/steps/lamps.h).
void trace_scattered_rays(graph::Graph& graph, const SceneView& view, const rays::RayBatch& batch, PathBuffers& paths);

}  // namespace halflight
