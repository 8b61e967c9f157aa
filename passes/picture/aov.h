// Data outputs of the surfaces seen through the pixels' centres, and of what it takes to trace rays there: not
// filtered, since a mean of ids or depths means nothing.
#pragma once

#include "passes/surface/gbuffer.h"

namespace halflight {

/// AovRecord (shaders/shared/aov.h) by path index. The frame constants must place the sample at the pixel's centre.
/// Without `motion` there is none.
graph::BufferHandle add_aov(graph::Graph& graph, const SceneView& view, const GBuffer& gbuffer, bool motion = true);

struct DebugOptions {
    bool nodes = false;    // traces the camera rays once more
    bool culling = false;  // reads the tile lists that the frame's last run has left; the same History must have run it
};
/// DebugRecord (shaders/shared/aov.h) by path index; 0 for what was not asked for.
graph::BufferHandle add_debug_aov(graph::Graph& graph, const SceneView& view, const GBuffer& gbuffer,
                                  const DebugOptions& options);

}  // namespace halflight
