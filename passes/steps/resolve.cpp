#include "passes/steps/resolve.h"

#include "engine/paging/row_gather.h"

namespace halflight {

using graph::Access;

graph::BufferHandle add_resolve(graph::Graph& graph, const SceneView& view, const char* name, const PathList& list,
                                PathBuffers& paths, const ResolveOptions& options) {
    graph::Pass pass = graph.add_pass(name);
    view.read_frame(pass);
    read_listed(pass, list, paths);
    if (paths.cones) pass.read(paths.cones, Access::texture_read, {"cones", GL_RG32F});
    if (paths.media) pass.read(paths.media, Access::texture_read, {"media", GL_RGBA32F});
    const bool by_chance = options.by_chance && view.scene.needs().panes;
    if (by_chance && view.scene.needs().solid_panes)
        pass.read(paths.states, Access::texture_read, {"state_texels", GL_RGBA32UI});
    const std::size_t bytes = view.band.paths() * view.scene.surface_record_bytes();
    const graph::BufferHandle surfaces =
        pass.write(graph.create_buffer("path surfaces", {bytes}), Access::storage_write, "Surfaces");
    if (options.reuse_points) paths.points = pass.write(paths.points, partial_write(paths.points), "Points");
    gpu::Defines defines = view.shading_defines();
    defines.set("HALFLIGHT_LIST");
    if (options.last) defines.set("HALFLIGHT_LAST_VERTEX");
    if (by_chance) defines.set("HALFLIGHT_BY_CHANCE");
    if (options.reuse_points) defines.set("HALFLIGHT_REUSE_POINTS");
    if (view.rows) defines.set("HALFLIGHT_GATHERED_ROWS");
    pass.kernel({"shaders/resolve.comp", defines, view.bind_hits()});
    pass.execute([=, hits = paths.hits, header = list.header](graph::Resources& r) {
        if (view.rows) view.rows->gather(r.buffer(hits), r.buffer(list.list), r.buffer(header));
        const gpu::Program& program = r.kernel();
        view.shade(program, [&] { program.dispatch_indirect(r.buffer(header), view.band.paths() / 64); });
    });
    return surfaces;
}

}  // namespace halflight
