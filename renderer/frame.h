// The whole frame, top to bottom.
#pragma once

#include "passes/picture/accumulate.h"
#include "passes/surface/gbuffer.h"
#include "renderer/needs.h"

namespace halflight {

struct Frame {
    GBuffer gbuffer;
    Accumulated sums;
};

/// Adds every pass that scene and options need for one sample of one band, and nothing else (frame_needs). Marks the
/// sums as outputs, and the hits of camera rays where they are wanted. seen_constants: of the sample's camera rays for
/// light that is seen directly, options.camera_rays of them where there is more than one.
Frame add_frame(graph::Graph& graph, const SceneView& view, const FrameOptions& options, gpu::Buffer& bad_values,
                const std::vector<graph::BufferHandle>& seen_constants = {});

}  // namespace halflight
