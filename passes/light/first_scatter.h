// Interreflection: the paths that leave the first surface through its diffuse or its glossy lobes.
#pragma once

#include "passes/steps/paths.h"
#include "passes/steps/surfaces.h"

namespace halflight {

/// Samples one component of the BSDF at the surfaces that picked it at random, traces the rays, and updates `paths`.
/// The first such pass of a frame also initialises the states of paths that end here.
PathList add_diffuse(graph::Graph& graph, const SceneView& view, const GBuffer& gbuffer, PathBuffers& paths);
PathList add_glossy(graph::Graph& graph, const SceneView& view, const GBuffer& gbuffer, PathBuffers& paths);

}  // namespace halflight
