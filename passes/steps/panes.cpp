#include "passes/steps/panes.h"

#include <functional>

#include "engine/rays/batch_server.h"
#include "passes/steps/lamps.h"

namespace halflight {
namespace {

using graph::Access;

/// Sets the kernel of a pass over the rays of a batch. `kernel` makes it anew for each run, because the hierarchies
/// over the panes may change their format with the pose.
void run(graph::Pass& pass, const rays::RayBatch& batch, const std::function<graph::Kernel()>& kernel) {
    pass.kernel(kernel());  // compiled ahead
    pass.execute([batch, kernel](graph::Resources& r) {
        const gpu::Program& program = r.kernel(kernel());
        if (batch.list)
            program.dispatch_indirect(r.buffer(batch.list_header), (batch.capacity + 63) / 64);
        else
            program.dispatch((batch.capacity + 63) / 64);
    });
}

/// Returns the rays of a batch that may meet panes. `read` declares what tells their ends.
template <class Read>
rays::RayBatch select(graph::Graph& graph, const SceneView& view, rays::RayBatch batch, const char* name,
                      gpu::Defines variant, const Read& read) {
    const rays::TraceScene& panes = *view.trace.panes();
    PathList met = create_path_list(graph, view, name, batch.capacity);
    graph::Pass pass = graph.add_pass("panes: select rays");
    pass.read(batch.rays, Access::texture_read, {"rays", GL_RGBA32F});
    if (batch.list) {
        variant.set("HALFLIGHT_LIST");
        pass.read(batch.list, Access::storage_read, "List");
        pass.read(batch.list_header, Access::storage_read, "Header");
        pass.read(batch.list_header, Access::indirect_read);
    }
    read(pass);
    met.list = pass.write(met.list, Access::storage_read_write, "Selected");
    met.header = pass.write(met.header, Access::storage_read_write, "SelectedHeader");
    run(pass, batch, [variant, &panes] {
        gpu::Defines defines = variant;
        for (const auto& [define, value] : panes.defines().values()) defines.set(define, value);
        return graph::Kernel{"shaders/pane_rays.comp", defines,
                             [&panes](graph::Resources&, const gpu::Program&) { panes.bind(); }};
    });
    batch.list = met.list, batch.list_header = met.header;
    return batch;
}

/// Finds what the rays of a batch pass. `read` declares what tells their ends, `write` what follows.
template <class Read, class Write>
void add_panes(graph::Graph& graph, const SceneView& view, rays::RayBatch batch, const char* name,
               const gpu::Defines& variant, const Read& read, const Write& write) {
    batch.passes_panes = false;  // the kernels look for panes
    batch = select(graph, view, batch, name, variant, read);
    const rays::TraceScene& panes = *view.trace.panes();
    graph::Pass pass = graph.add_pass(name);
    rays::read_batch(pass, panes, batch);
    write(pass);
    run(pass, batch, [view, variant, batch, &panes] {
        gpu::Defines all = variant;
        for (const gpu::Defines& defines : {view.path_defines(), rays::batch_defines(panes, batch)})
            for (const auto& [define, value] : defines.values()) all.set(define, value);
        return graph::Kernel{"shaders/panes.comp", all,
                             [view, batch, &panes](graph::Resources& r, const gpu::Program& program) {
                                 view.scene.bind();
                                 rays::bind_batch(r, program, panes, batch);
                                 if (panes.triangle_ids().bytes() > 0)
                                     program.bind_texture("triangle_ids", panes.triangle_ids(), GL_R32UI);
                             }};
    });
}

}  // namespace

graph::BufferHandle trace_shadow_rays(graph::Graph& graph, const SceneView& view, const rays::RayBatch& batch,
                                      graph::BufferHandle answers) {
    answers = rays::any_hit(graph, view.tracer, batch, answers);
    if (!view.trace.panes()) return answers;
    add_panes(
        graph, view, batch, "panes: shadow rays", {},
        [&](graph::Pass& pass) {
            pass.read(answers, Access::texture_read, {"occluded", GL_R32UI});
        },
        [&](graph::Pass& pass) { answers = pass.write(answers, Access::storage_read_write, "Occluded"); });
    return answers;
}

void trace_scattered_rays(graph::Graph& graph, const SceneView& view, const rays::RayBatch& batch, PathBuffers& paths) {
    paths.hits = rays::closest_hit(graph, view.tracer, batch, paths.hits);
    add_met_lamps(graph, view, batch, paths);
    if (!view.trace.panes()) return;
    const auto read = [&](graph::Pass& pass) { pass.read(paths.hits, Access::texture_read, {"hits", GL_R32UI}); };
    const bool solids = view.scene.needs().solid_panes;
    add_panes(graph, view, batch, "panes: scattered rays", {{"HALFLIGHT_SCATTERED", "1"}}, read,
              [&](graph::Pass& pass) {
                  if (solids && paths.media) pass.read(paths.media, Access::texture_read, {"media", GL_RGBA32F});
                  paths.hits = pass.write(paths.hits, Access::storage_read_write, "Hits");
                  paths.states = pass.write(paths.states, Access::storage_read_write, "States");
                  if (paths.met_lamps)
                      paths.met_lamps = pass.write(paths.met_lamps, Access::storage_read_write, "MetLamps");
              });
}

}  // namespace halflight
