// Direct light at the first surface: next-event estimation, one shadow ray per path.
#pragma once

#include "passes/gbuffer.h"

namespace halflight {

struct DirectLightEstimate {
    graph::BufferHandle light;     // DirectLight, by component, as if visible
    graph::BufferHandle occluded;  // uint: 1 where the shadow ray met something, or where there was none
};

/// Picks one of all lights by power (area, punctual, environment), weights it by the power heuristic against BSDF
/// sampling of each component (SHADING.md, Estimator), and traces the shadow ray through any_hit.
DirectLightEstimate add_shadow(graph::Graph& graph, const SceneView& view, const GBuffer& gbuffer);

}  // namespace halflight
