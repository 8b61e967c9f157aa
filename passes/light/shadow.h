// Direct light at the first surface: next-event estimation, SceneView::shadow_rays shadow rays per path, and one more
// to the sun where it is apart.
#pragma once

#include "passes/surface/gbuffer.h"

namespace halflight {

struct DirectLightEstimate {
    // DirectLight, by component, as if visible: shares of the mean over the first shadow rays of all paths, of the
    // second ones and so on, then, where the sun is apart, what it gives.
    graph::BufferHandle light;
    graph::BufferHandle occluded;      // uint: 1 where the shadow ray met something, or where there was none; likewise
    graph::BufferHandle sun_occluded;  // of the sun; none where the sun is not apart
};

/// For each shadow ray picks one of all lights (engine/tables/lights.h says how), weights it by the power heuristic
/// against BSDF sampling of each component (SHADING.md, Estimator), and traces the shadow ray through any_hit. Does the
/// same of the sun, where it is apart from those lights (SceneNeeds::sun).
DirectLightEstimate add_shadow(graph::Graph& graph, const SceneView& view, const GBuffer& gbuffer);

}  // namespace halflight
