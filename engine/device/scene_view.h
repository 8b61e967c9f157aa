// What the passes of a frame have in common: the scene on the GPU, the band of paths, the compiled kernels.
#pragma once

#include <cstdint>

#include "engine/device/scene_buffers.h"
#include "engine/gpu/program.h"
#include "engine/graph/execute.h"
#include "engine/rays/tracer.h"

namespace halflight {

/// The part of the image that one run of the frame graph renders: whole rows, padded to 16x16 blocks.
struct Band {
    ivec2 image{0};  // size of the whole image, pixels
    int y = 0;       // first row
    int rows = 0;    // rows, > 0

    uvec2 tiles() const { return {(image.x + 15) / 16, (rows + 15) / 16}; }
    std::uint32_t paths() const { return tiles().x * tiles().y * 256; }
};

class RadianceCache;

/// References outlive the graph; passes may capture them.
struct SceneView {
    gpu::ProgramCache& programs;
    const SceneBuffers& scene;
    const rays::TraceScene& trace;
    rays::Tracer& tracer;                     // of `trace`
    Band band;                                // the largest one: buffers are made for it
    graph::BufferHandle frame_constants;      // struct Frame
    std::uint32_t place = 0;                  // of the picture: RayBatch::place
    const Band* current = nullptr;            // the one that the constants are of; null: rows of others are drawn, too
    std::uint32_t sums = 0;                   // which ones samples are added to, where bands have their own
    RadianceCache* radiance_cache = nullptr;  // where paths are to use one
    std::uint32_t shadow_rays = 1;            // of each path from its first surface to chosen lights
    std::uint32_t group_size = 1;             // pixels that share their paths
};

}  // namespace halflight
