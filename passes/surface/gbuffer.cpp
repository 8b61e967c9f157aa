#include "passes/surface/gbuffer.h"

#include <algorithm>
#include <cassert>
#include <optional>

#include "engine/paging/row_gather.h"
#include "engine/rays/tracer.h"
#include "passes/steps/lamps.h"
#include "passes/surface/raster_window.h"
#include "shaders/shared/ray_structs.h"

namespace halflight {
namespace {

using graph::Access;

/// Scissor test of a band. Nothing is drawn or cleared outside of its pixels and their neighbours.
class BandScissor {
  public:
    BandScissor(const Band& band, const RasterWindow& window) {
        const int y = band.origin.y + band.y, first = std::max(y - 1 - window.y, 0);
        const int x = std::max(band.origin.x - 1, 0), end = std::min(band.origin.x + band.image.x + 1, band.whole().x);
        glEnable(GL_SCISSOR_TEST);
        glScissor(x, first, end - x, y + band.rows + 1 - window.y - first);
    }
    ~BandScissor() { glDisable(GL_SCISSOR_TEST); }
    BandScissor(const BandScissor&) = delete;
    BandScissor& operator=(const BandScissor&) = delete;
};

/// Sets a viewport larger than the target, and returns the target's share of it. Triangles that reach far beyond the
/// viewport are clipped at its edges, with an error of 2^-24 of their reach. The error is pixels wide for a wall that
/// stands 10^-6 of its length before the camera.
float widen_viewport(const gpu::Framebuffer& target) {
    constexpr int kLargest = 16384;  // viewport size that every driver allows, like that of textures
    if (2 * std::max(target.width(), target.height()) > kLargest) return 1;
    const auto width = static_cast<float>(target.width()), height = static_cast<float>(target.height());
    glViewportIndexedf(0, -0.5f * width, -0.5f * height, 2 * width, 2 * height);
    return 0.5f;
}

/// Sets the define of kernels that leave out back faces which camera rays pass.
void set_backfaces(const SceneView& view, gpu::Defines& defines) {
    if (view.pass_backs(rays::RayKind::primary) != rays::PassBacks::none) defines.set("HALFLIGHT_CULL_SEEN");
}

void rasterize(const SceneView& view, GBuffer& g, graph::Graph& graph) {
    const int rows = raster_window(view.band).rows;
    const int columns = view.band.whole().x;
    const gpu::TextureDesc visibility{columns, rows, GL_RG32UI};
    const gpu::TextureDesc depth{columns, rows, GL_DEPTH_COMPONENT32F};
    graph::Pass pass = graph.add_pass("gbuffer: rasterize");
    pass.read(view.frame_constants, Access::uniform_read, "FrameBlock");
    g.visibility = pass.write(graph.create_texture("visibility", visibility), Access::color_attachment);
    g.depth = pass.write(graph.create_texture("depth", depth), Access::depth_attachment);
    gpu::Defines defines = view.scene.defines();
    set_backfaces(view, defines);
    pass.kernel({.source = "shaders/gbuffer.vert", .defines = defines, .fragment = "shaders/gbuffer.frag"});
    pass.execute([view, g](graph::Resources& r) {
        const gpu::Program& program = r.kernel();
        const gpu::Framebuffer& target = r.framebuffer({g.visibility}, g.depth);
        target.bind();
        std::optional<BandScissor> scissor;
        if (view.current) scissor.emplace(*view.current, raster_window(*view.current));
        target.clear_color_uint(0, 0);
        target.clear_depth(0);  // reversed: 0 is infinitely far
        view.scene.bind();
        program.bind();
        program.set("viewport_share", widen_viewport(target));
        view.scene.draw(program);
    });
}

/// Adds the passes that trace camera rays. `number`: depth of the batch, unique among the graph's primary batches.
void trace(const SceneView& view, GBuffer& g, graph::Graph& graph, std::uint32_t number) {
    const std::uint32_t paths = view.band.paths();
    graph::Pass pass = graph.add_pass("gbuffer: camera rays");
    view.read_frame(pass);
    g.rays =
        pass.write(graph.create_buffer("primary rays", {paths * sizeof(shared::Ray)}), Access::storage_write, "Rays");
    gpu::Defines defines = view.camera_defines();
    if (view.sampled_blocks) defines.set("HALFLIGHT_SAMPLED_BLOCKS");
    // The tracer's alpha tests need tables of the scene; another scene may be bound.
    pass.kernel({"shaders/camera_rays.comp", defines, view.bind_scene()});
    pass.execute([=](graph::Resources& r) { r.kernel().dispatch(paths / 64); });
    const rays::RayBatch batch{.kind = rays::RayKind::primary,
                               .depth = number,
                               .place = view.place,
                               .capacity = paths,
                               .rays = g.rays,
                               .list = {},
                               .list_header = {},
                               .frame_constants = view.frame_constants,
                               .sampled_blocks = view.sampled_blocks,
                               .backfaces = view.pass_backs(rays::RayKind::primary)};
    g.hits = rays::closest_hit(graph, view.tracer, batch,
                               graph.create_buffer("primary hits", {paths * sizeof(shared::Hit)}));
}

/// Adds the passes that find hits, without the passes that use them.
GBuffer visible(graph::Graph& graph, const SceneView& view, PrimaryVisibility primary, std::uint32_t number) {
    assert(!(view.lens || view.optics) || primary == PrimaryVisibility::traced);
    GBuffer g;
    if (primary == PrimaryVisibility::traced)
        trace(view, g, graph, number);
    else
        rasterize(view, g, graph);
    return g;
}

/// Declares that a pass of resolve.comp reads the results of visible().
void read_hits(graph::Pass& pass, const SceneView& view, const GBuffer& g, gpu::Defines& defines) {
    if (g.visibility) {
        set_backfaces(view, defines);
        pass.read(g.visibility, Access::image_read, "visibility");
        return;
    }
    pass.read(g.rays, Access::texture_read, {"rays", GL_RGBA32F});
    pass.read(g.hits, Access::texture_read, {"hits", GL_R32UI});
    defines.set("HALFLIGHT_TRACED");
    if (view.rows) defines.set("HALFLIGHT_GATHERED_ROWS");
}

/// Loads the rows of the hits if the scene's geometry is not in memory.
void gather_rows(const SceneView& view, const GBuffer& g, graph::Resources& r) {
    if (view.rows) view.rows->gather(r.buffer(g.hits), view.band.paths());
}

/// Declares that a pass of resolve.comp stores rays and hits of rasterized visibility.
void store(graph::Graph& graph, graph::Pass& pass, const SceneView& view, GBuffer& g, const GBufferOutputs& outputs,
           gpu::Defines& defines) {
    if (!g.visibility) return;
    const std::size_t paths = view.band.paths();
    if (outputs.rays) {
        g.rays = pass.write(graph.create_buffer("primary rays", {paths * sizeof(shared::Ray)}), Access::storage_write,
                            "Rays");
        defines.set("HALFLIGHT_STORE_RAYS");
    }
    if (outputs.hits) {
        g.hits = pass.write(graph.create_buffer("primary hits", {paths * sizeof(shared::Hit)}), Access::storage_write,
                            "Hits");
        defines.set("HALFLIGHT_STORE_HITS");
    }
}

void resolve(const SceneView& view, GBuffer& g, const GBufferOutputs& outputs, graph::Graph& graph) {
    const std::size_t paths = view.band.paths();
    graph::Pass pass = graph.add_pass("gbuffer: resolve");
    view.read_frame(pass);
    gpu::Defines defines = view.camera_defines(view.shading_defines());
    read_hits(pass, view, g, defines);
    store(graph, pass, view, g, outputs, defines);
    g.surfaces = pass.write(graph.create_buffer("primary surfaces", {paths * view.scene.surface_record_bytes()}),
                            Access::storage_write, "Surfaces");
    pass.kernel({"shaders/resolve.comp", defines, view.bind_hits()});
    pass.execute([view, g, paths](graph::Resources& r) {
        gather_rows(view, g, r);
        const gpu::Program& program = r.kernel();
        view.shade(program, [&] { program.dispatch(static_cast<std::uint32_t>(paths / 64)); });
    });
}

}  // namespace

GBuffer add_gbuffer(graph::Graph& graph, const SceneView& view, const GBufferOutputs& outputs,
                    PrimaryVisibility primary) {
    GBuffer g = visible(graph, view, primary, 0);
    resolve(view, g, outputs, graph);
    return g;
}

graph::BufferHandle add_seen(graph::Graph& graph, const SceneView& view,
                             const std::vector<graph::BufferHandle>& frame_constants, PrimaryVisibility primary,
                             bool lamps) {
    const std::size_t paths = view.band.paths();
    graph::BufferHandle seen = graph.create_buffer("light seen", {paths * (1 + view.light_groups) * sizeof(vec4)});
    std::uint32_t number = 0;
    for (const graph::BufferHandle& constants : frame_constants) {
        SceneView through = view;
        through.frame_constants = constants;
        GBuffer g = visible(graph, through, primary, ++number);
        const bool first = constants == frame_constants.front();
        graph::Pass pass = graph.add_pass("gbuffer: light seen");
        pass.read(constants, Access::uniform_read, "FrameBlock");
        gpu::Defines defines = view.camera_defines(view.shading_defines());
        defines.set("HALFLIGHT_SEEN");
        if (view.light_groups > 0 && view.rows) defines.set("HALFLIGHT_SORTED_EMITTERS");
        read_hits(pass, view, g, defines);
        store(graph, pass, view, g, {.rays = lamps, .hits = lamps}, defines);
        seen = pass.write(seen, first ? Access::storage_write : Access::storage_read_write, "LightSeen");
        const float weight = 1.0f / static_cast<float>(frame_constants.size());
        pass.kernel({"shaders/resolve.comp", defines, view.bind_hits()});
        pass.execute([=](graph::Resources& r) {
            gather_rows(view, g, r);
            const gpu::Program& program = r.kernel();
            program.set("weight", weight);
            program.set("begins", first);
            view.shade(program, [&] { program.dispatch(static_cast<std::uint32_t>(paths / 64)); });
        });
        if (lamps) seen = add_shown_lamps(graph, through, g, seen, weight);
    }
    return seen;
}

}  // namespace halflight
