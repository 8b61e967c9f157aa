// Data outputs of the surfaces at the pixels' centres, and the cost of tracing there. They are not filtered, since a
// mean of ids or depths means nothing.
#pragma once

#include "passes/steps/surfaces.h"

namespace halflight {

/// Returns an AovRecord (shaders/shared/aov_record.h) per path. The frame constants must place the sample at the
/// pixel's centre. `motion` tells whether to fill AovRecord::motion; otherwise it is 0.
graph::BufferHandle add_aov(graph::Graph& graph, const SceneView& view, const GBuffer& gbuffer, bool motion = true);

struct DebugOptions {
    bool nodes = false;      // whether to count nodes, by tracing the camera rays again
    bool culling = false;    // whether to read the tile lists that the last frame left in the same History
    bool residency = false;  // whether to find the pages of surfaces, in scenes that are loaded in pages
    bool any() const { return nodes || culling || residency; }
};
/// Returns a DebugRecord (shaders/shared/aov_record.h) per path; fields that were not requested are 0.
graph::BufferHandle add_debug_aov(graph::Graph& graph, const SceneView& view, const GBuffer& gbuffer,
                                  const DebugOptions& options);

}  // namespace halflight
