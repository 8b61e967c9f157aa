#include "passes/aov.h"

#include "shaders/shared/aov.h"
#include "shaders/shared/bindings.h"

namespace halflight {

using graph::Access;

graph::BufferHandle add_aov(graph::Graph& graph, const SceneView& view, const GBuffer& gbuffer) {
    graph::Pass pass = graph.add_pass("aov");
    pass.read(view.frame_constants, Access::uniform_read);
    pass.read(gbuffer.hits, Access::storage_read);
    pass.read(gbuffer.surfaces, Access::storage_read);
    const graph::BufferHandle records = pass.write(
        graph.create_buffer("aov records", {view.band.paths() * sizeof(shared::AovRecord)}), Access::storage_write);
    pass.execute([=](graph::Resources& r) {
        r.buffer(view.frame_constants).bind_uniform(BLOCK_FRAME);
        r.buffer(gbuffer.hits).bind_storage(0);
        r.buffer(gbuffer.surfaces).bind_storage(1);
        r.buffer(records).bind_storage(2);
        r.programs().compute("shaders/aov.comp", view.scene.defines()).dispatch(view.band.paths() / 64);
    });
    return records;
}

}  // namespace halflight
