// Diffuse interreflection: the paths that leave the first surface through its diffuse lobe.
#pragma once

#include "passes/light/scatter.h"

namespace halflight {

/// Sends a cosine-distributed ray from every surface at which the diffuse component was picked, and traces it.
PathList add_diffuse(graph::Graph& graph, const SceneView& view, const GBuffer& gbuffer, PathBuffers& paths);

}  // namespace halflight
