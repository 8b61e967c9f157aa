// Inputs that all passes of a frame share: the scene on the device, the band of paths, the compiled kernels.
#pragma once

#include <cstdint>
#include <functional>

#include "engine/device/scene_buffers.h"
#include "engine/gpu/program_cache.h"
#include "engine/graph/execute.h"
#include "engine/rays/tracer.h"
#include "engine/settings/visibility.h"

namespace halflight {

/// The rows of the image that one run of the frame graph renders, padded to 16x16 blocks.
struct Band {
    ivec2 image{0};  // size of the image that all bands make, pixels
    int y = 0;       // first row of the band
    int rows = 0;    // number of rows, > 0
    // Where `image` is a part of a larger picture:
    ivec2 origin{0};   // its upper left pixel in the larger picture; may lie beyond the edge of that
    ivec2 display{0};  // size of the larger picture, pixels; 0: `image` is the whole

    /// Returns the size of the whole picture, whose camera it has.
    ivec2 whole() const { return display.x > 0 ? display : image; }
    uvec2 tiles() const { return {(image.x + 15) / 16, (rows + 15) / 16}; }
    std::uint32_t paths() const { return tiles().x * tiles().y * 256; }
};

namespace paging {
class RowGather;
}

/// Inputs of all passes. The referenced objects outlive the graph; passes may capture them.
struct SceneView {
    const SceneBuffers& scene;
    const rays::TraceScene& trace;
    rays::Tracer& tracer;                   // tracer of `trace`
    Band band;                              // the largest band, for which buffers are sized
    graph::BufferHandle frame_constants;    // buffer of struct Frame
    std::uint32_t place = 0;                // value for RayBatch::place
    const Band* current = nullptr;          // band of the frame constants; null: rows of other bands are drawn, too
    paging::RowGather* rows = nullptr;      // table rows of hits, for scenes that are loaded in pages; else null
    std::uint32_t shadow_rays = 1;          // shadow rays per path, from its first surface to chosen lights
    std::uint32_t light_groups = 0;         // number of light groups whose light is summed apart; 0: none
    bool lens = false;                      // camera rays start on the lens of the frame constants
    graph::BufferHandle sampled_blocks{};   // buffer of SampledBlock, which places the paths; null: one per pixel
    bool optics = false;                    // camera rays follow shaders/shared/ray_projections.h
    Backfaces backfaces = Backfaces::show;  // rays that pass back faces

    /// Returns which rays of a batch pass back faces.
    rays::PassBacks pass_backs(rays::RayKind kind) const;
    /// Returns whether the rays of a batch pass panes: shadow rays and scattered rays do (passes/steps/panes.h).
    bool passes_panes(rays::RayKind kind) const;
    /// Returns a function for Pass::kernel() that binds the scene's tables. Tables of triangles are those of emitters
    /// if geometry is loaded in pages.
    std::function<void(graph::Resources&, const gpu::Program&)> bind_scene() const;
    /// Returns a function like bind_scene(), with the tables of triangles that rays have hit.
    std::function<void(graph::Resources&, const gpu::Program&)> bind_hits() const;
    /// Declares that the kernel of a pass reads the frame constants, and with path_defines() the pixels of paths.
    void read_frame(graph::Pass& pass) const;
    /// Returns the defines of kernels that use the pixels of paths, shaders/lib/path_pixel.glsl, light groups, or
    /// HALFLIGHT_BACKFACES. With the last one, rays of paths that pass back faces are marked, or with kEveryRay no
    /// light leaves backs.
    gpu::Defines path_defines() const;
    /// Returns the defines of kernels that use camera rays.
    gpu::Defines camera_defines(gpu::Defines others = {}) const;
    /// Returns the defines of kernels that look up the textures of hits, shaders/resolve.comp.
    gpu::Defines shading_defines() const;
    /// Runs such a kernel. `all` dispatches it for its whole batch, one invocation per path at most. If textures are
    /// in tiles, some invocations run again.
    void shade(const gpu::Program& kernel, const std::function<void()>& all) const;
};

}  // namespace halflight
