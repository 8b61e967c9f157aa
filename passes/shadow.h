// Direct light at the first surface: next-event estimation, one shadow ray per path, and one more to the sun where it
// is apart.
#pragma once

#include "passes/gbuffer.h"

namespace halflight {

struct DirectLightEstimate {
    // DirectLight, by component, as if visible: of the chosen lights, then, where the sun is apart, of the sun
    graph::BufferHandle light;
    graph::BufferHandle occluded;      // uint: 1 where the shadow ray met something, or where there was none
    graph::BufferHandle sun_occluded;  // likewise; none where the sun is not apart
};

/// Picks one of all lights (engine/scene/lights.h says how), weights it by the power heuristic against BSDF
/// sampling of each component (SHADING.md, Estimator), and traces the shadow ray through any_hit. Does the same of the
/// sun, where it is apart from those lights (SceneNeeds::sun).
DirectLightEstimate add_shadow(graph::Graph& graph, const SceneView& view, const GBuffer& gbuffer);

}  // namespace halflight
