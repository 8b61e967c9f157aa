#include "passes/picture/aov.h"

#include "passes/light/scatter.h"
#include "shaders/shared/aov.h"
#include "shaders/shared/bindings.h"

namespace halflight {

using graph::Access;

graph::BufferHandle add_aov(graph::Graph& graph, const SceneView& view, const GBuffer& gbuffer, bool motion) {
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
        gpu::Defines defines = view.scene.defines();
        if (motion) defines.set("HALFLIGHT_MOTION");
        r.programs().compute("shaders/aov.comp", defines).dispatch(view.band.paths() / 64);
    });
    return records;
}

graph::BufferHandle add_debug_aov(graph::Graph& graph, const SceneView& view, const GBuffer& gbuffer,
                                  const DebugOptions& options) {
    const rays::RayBatch shadow = ray_batch(view, rays::RayKind::shadow, {}, {}, 0);
    const graph::BufferHandle lists =
        options.culling ? rays::kept_lists(graph, view.tracer, shadow) : graph::BufferHandle();
    graph::Pass pass = graph.add_pass("debug aov");
    pass.read(view.frame_constants, Access::uniform_read);
    pass.read(gbuffer.rays, Access::storage_read);
    if (lists) pass.read(lists, Access::texture_read);
    const graph::BufferHandle records = pass.write(
        graph.create_buffer("debug records", {view.band.paths() * sizeof(shared::DebugRecord)}), Access::storage_write);
    pass.execute([=](graph::Resources& r) {
        gpu::Defines defines = rays::tile_defines(view.trace, shadow, view.tracer.tile_settings());
        if (options.nodes) defines.set("HALFLIGHT_COUNT");
        if (lists && view.tracer.ran_by_tiles(shadow)) {
            defines.set("TILE_LISTS");
            r.buffer(lists).bind_texture(UNIT_FREE + 1, GL_RGBA32UI);
        }
        r.buffer(view.frame_constants).bind_uniform(BLOCK_FRAME);
        r.buffer(gbuffer.rays).bind_storage(0);
        r.buffer(records).bind_storage(1);
        view.trace.bind();
        view.scene.bind();
        r.programs().compute("shaders/debug_aov.comp", defines).dispatch(view.band.paths() / 64);
    });
    return records;
}

}  // namespace halflight
