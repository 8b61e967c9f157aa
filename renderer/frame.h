// The whole frame: every pass of a sample, top to bottom.
#pragma once

#include "passes/picture/accumulate.h"
#include "passes/surface/gbuffer.h"
#include "renderer/needs.h"

namespace halflight {

class RadianceCache;

/// Objects of the renderer that the passes of a frame use. They outlive the graph.
struct FrameInputs {
    gpu::Buffer& bad_values;  // kBadValueCounts uints
    // Frame constants of the camera rays for directly visible light: options.camera_rays of them, or none for one ray
    std::vector<graph::BufferHandle> seen_constants{};
    RadianceCache* cache = nullptr;  // radiance cache of the paths; null: none
    std::uint32_t sums = 0;          // index of the sums, if bands have sums of their own
};

struct Frame {
    GBuffer gbuffer;
    Accumulated sums;
};

/// Adds the passes that scene and options need for one sample of one band, and no others (frame_needs). Marks the sums
/// as outputs, and the hits of camera rays if options.want_hits is set.
Frame add_frame(graph::Graph& graph, const SceneView& view, const FrameOptions& options, const FrameInputs& inputs);

}  // namespace halflight
