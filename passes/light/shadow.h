// Direct light at the first surface by next-event estimation: SceneView::shadow_rays shadow rays per path, and one more
// to the sun if it is sampled separately.
#pragma once

#include "passes/steps/light_answers.h"
#include "passes/steps/surfaces.h"

namespace halflight {

/// Picks a light for each shadow ray (engine/tables/lights.h) and traces the ray by any_hit(). The power heuristic
/// weights it against BSDF sampling of each component (SHADING.md, Estimator). The sun gets its own rays if it is
/// sampled separately (SceneNeeds::sun).
DirectLightEstimate add_shadow(graph::Graph& graph, const SceneView& view, const GBuffer& gbuffer);

}  // namespace halflight
