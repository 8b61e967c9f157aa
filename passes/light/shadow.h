// Direct light at the first surface by next-event estimation: SceneView::shadow_rays shadow rays per path, and one more
// to the sun if it is sampled separately.
#pragma once

#include "passes/surface/gbuffer.h"

namespace halflight {

struct DirectLightEstimate {
    // DirectLight per ray, as if visible, weighted for the mean. The first shadow rays of all paths come first, then
    // the second ones and so on. Last come the sun rays of all paths, if the sun is sampled separately.
    graph::BufferHandle light;
    graph::BufferHandle occluded;      // uint per shadow ray, in the same order: answer (passes/light/panes.h)
    graph::BufferHandle sun_occluded;  // uint per path: answer for the sun; empty unless the sun is sampled separately
    rays::RayBatch rays{};             // batch of the shadow rays
    rays::RayBatch sun_rays{};         // batch of the sun rays; empty like sun_occluded
};

/// Returns the batch of the shadow rays at the first surface, in the order of DirectLightEstimate::light. kind: shadow
/// for chosen lights, or sun.
rays::RayBatch shadow_batch(const SceneView& view, rays::RayKind kind, graph::BufferHandle rays);

/// Picks a light for each shadow ray (engine/tables/lights.h) and traces the ray by any_hit(). The power heuristic
/// weights it against BSDF sampling of each component (SHADING.md, Estimator). The sun gets its own rays if it is
/// sampled separately (SceneNeeds::sun).
DirectLightEstimate add_shadow(graph::Graph& graph, const SceneView& view, const GBuffer& gbuffer);

}  // namespace halflight
