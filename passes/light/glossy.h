// Glossy interreflection: the paths that leave the first surface through any lobe but the diffuse one.
#pragma once

#include "passes/light/scatter.h"

namespace halflight {

/// Sends a ray by the distribution of visible GGX normals (Heitz 2018) from every surface at which the glossy component
/// was picked, and traces it.
PathList add_glossy(graph::Graph& graph, const SceneView& view, const GBuffer& gbuffer, PathBuffers& paths);

}  // namespace halflight
