// Data outputs of the surfaces seen through the pixels' centres: not filtered, since a mean of ids or depths means
// nothing.
#pragma once

#include "passes/gbuffer.h"

namespace halflight {

/// AovRecord (shaders/shared/aov.h) by path index. The frame constants must place the sample at the pixel's centre.
graph::BufferHandle add_aov(graph::Graph& graph, const SceneView& view, const GBuffer& gbuffer);

}  // namespace halflight
