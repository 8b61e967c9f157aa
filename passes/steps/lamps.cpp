#include "passes/steps/lamps.h"

#include "shaders/shared/path_state.h"

namespace halflight {

using graph::Access;

void add_met_lamps(graph::Graph& graph, const SceneView& view, const rays::RayBatch& batch, PathBuffers& paths) {
    if (!paths.met_lamps) return;
    graph::Pass pass = graph.add_pass("lamps met");
    view.read_frame(pass);
    read_listed(pass, {batch.list, batch.list_header}, paths);
    pass.read(paths.states, Access::storage_read, "States");
    pass.read(paths.receivers, Access::storage_read, "Receivers");
    if (paths.media) pass.read(paths.media, Access::texture_read, {"media", GL_RGBA32F});
    paths.met_lamps = pass.write(paths.met_lamps, partial_write(paths.met_lamps), "MetLamps");
    gpu::Defines defines = view.path_defines();
    if (view.rows) defines.set("HALFLIGHT_SORTED_EMITTERS");
    if (batch.depth == 0) {
        defines.set("HALFLIGHT_FIRST_HIT");
        defines.set("HALFLIGHT_SHADOW_RAYS", view.shadow_rays);
    }
    pass.kernel({"shaders/lamps.comp", defines, view.bind_scene()});
    pass.execute([=, header = batch.list_header](graph::Resources& r) {
        const gpu::Program& program = r.kernel();
        program.set("depth", batch.depth);
        program.dispatch_indirect(r.buffer(header), view.band.paths() / 64);
    });
}

graph::BufferHandle add_shown_lamps(graph::Graph& graph, const SceneView& view, const GBuffer& visible,
                                    graph::BufferHandle seen, float weight) {
    const bool begins = !seen;
    if (begins) seen = graph.create_buffer("lamps seen", {view.band.paths() * (1 + view.light_groups) * sizeof(vec4)});
    graph::Pass pass = graph.add_pass("lamps seen");
    view.read_frame(pass);
    pass.read(visible.rays, Access::texture_read, {"rays", GL_RGBA32F});
    pass.read(visible.hits, Access::texture_read, {"hits", GL_R32UI});
    seen = pass.write(seen, begins ? Access::storage_write : Access::storage_read_write, "LightSeen");
    gpu::Defines defines = view.path_defines();
    defines.set("HALFLIGHT_CAMERA");
    pass.kernel({"shaders/lamps.comp", defines, view.bind_scene()});
    pass.execute([=](graph::Resources& r) {
        const gpu::Program& program = r.kernel();
        program.set("weight", weight);
        program.set("begins", begins);
        program.dispatch(view.band.paths() / 64);
    });
    return seen;
}

}  // namespace halflight
