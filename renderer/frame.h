// The whole frame: every pass of a sample, top to bottom.
#pragma once

#include "passes/picture/accumulate.h"
#include "passes/surface/gbuffer.h"
#include "renderer/needs.h"

namespace halflight {

class RadianceCache;

struct Frame {
    GBuffer gbuffer;
    Accumulated sums;
};

/// Adds the passes that scene and options need for one sample of one band, and no others (frame_needs). Marks the sums
/// as outputs, and the hits of camera rays if options.want_hits is set. seen_constants: frame constants of the camera
/// rays for directly visible light. There are options.camera_rays of them, or none for one ray. cache: radiance cache
/// of the paths; null: none.
Frame add_frame(graph::Graph& graph, const SceneView& view, const FrameOptions& options, gpu::Buffer& bad_values,
                const std::vector<graph::BufferHandle>& seen_constants = {}, RadianceCache* cache = nullptr);

}  // namespace halflight
