#include "passes/light/panes.h"

#include "engine/rays/batch_server.h"

namespace halflight {
namespace {

using graph::Access;

/// Runs shaders/panes.comp for a batch. `declare` declares what the variant changes.
template <class Declare>
void add_panes(graph::Graph& graph, const SceneView& view, rays::RayBatch batch, const char* name,
               gpu::Defines variant, const Declare& declare) {
    batch.panes = rays::PassPanes::none;  // the kernel looks for them
    const rays::TraceScene& panes = *view.trace.panes();
    graph::Pass pass = graph.add_pass(name);
    rays::read_batch(pass, panes, batch);
    declare(pass);
    for (const gpu::Defines& defines : {view.path_defines(), rays::batch_defines(panes, batch)})
        for (const auto& [define, value] : defines.values()) variant.set(define, value);
    if (batch.list) variant.set("HALFLIGHT_LIST");
    pass.kernel({"shaders/panes.comp", variant, [view, &panes, batch](graph::Resources& r, const gpu::Program& program) {
                     view.scene.bind();
                     rays::bind_batch(r, program, panes, batch);
                     if (panes.triangle_ids().bytes() > 0)
                         program.bind_texture("triangle_ids", panes.triangle_ids(), GL_R32UI);
                 }});
    pass.execute([batch](graph::Resources& r) {
        if (batch.list)
            r.kernel().dispatch_indirect(r.buffer(batch.list_header), (batch.capacity + 63) / 64);
        else
            r.kernel().dispatch((batch.capacity + 63) / 64);
    });
}

}  // namespace

graph::BufferHandle trace_shadow_rays(graph::Graph& graph, const SceneView& view, const rays::RayBatch& batch,
                                      graph::BufferHandle answers) {
    answers = rays::any_hit(graph, view.tracer, batch, answers);
    if (!view.trace.panes()) return answers;
    add_panes(graph, view, batch, "panes: shadow rays", {}, [&](graph::Pass& pass) {
        answers = pass.write(answers, Access::storage_read_write, "Occluded");
    });
    return answers;
}

void trace_scattered_rays(graph::Graph& graph, const SceneView& view, const rays::RayBatch& batch, PathBuffers& paths) {
    paths.hits = rays::closest_hit(graph, view.tracer, batch, paths.hits);
    if (!view.trace.panes()) return;
    add_panes(graph, view, batch, "panes: scattered rays", {{"HALFLIGHT_SCATTERED", "1"}}, [&](graph::Pass& pass) {
        pass.read(paths.hits, Access::texture_read, {"hits", GL_R32UI});
        paths.states = pass.write(paths.states, Access::storage_read_write, "States");
    });
}

}  // namespace halflight
