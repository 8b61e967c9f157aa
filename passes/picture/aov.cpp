#include "passes/picture/aov.h"

#include "passes/steps/paths.h"
#include "shaders/shared/aov_record.h"

namespace halflight {

using graph::Access;

graph::BufferHandle add_aov(graph::Graph& graph, const SceneView& view, const GBuffer& gbuffer, bool motion) {
    graph::Pass pass = graph.add_pass("aov");
    pass.read(view.frame_constants, Access::uniform_read, "FrameBlock");
    pass.read(gbuffer.hits, Access::storage_read, "Hits");
    pass.read(gbuffer.surfaces, Access::texture_read, {"surfaces", GL_RGBA32F});
    const graph::BufferHandle records =
        pass.write(graph.create_buffer("aov records", {view.band.paths() * sizeof(shared::AovRecord)}),
                   Access::storage_write, "Records");
    gpu::Defines defines = view.camera_defines(view.scene.defines());
    if (motion) defines.set("HALFLIGHT_MOTION");
    pass.kernel({"shaders/aov.comp", defines});
    pass.execute([=](graph::Resources& r) { r.kernel().dispatch(view.band.paths() / 64); });
    return records;
}

graph::BufferHandle add_debug_aov(graph::Graph& graph, const SceneView& view, const GBuffer& gbuffer,
                                  const DebugOptions& options) {
    const rays::RayBatch shadow =
        shadow_batch(view, rays::RayKind::shadow, {});  // the first rays of all paths are first
    const graph::BufferHandle lists =
        options.culling ? rays::kept_lists(graph, view.tracer, shadow) : graph::BufferHandle();
    graph::Pass pass = graph.add_pass("debug aov");
    pass.read(view.frame_constants, Access::uniform_read, "FrameBlock");
    pass.read(gbuffer.rays, Access::storage_read, "Rays");
    if (lists) pass.read(lists, Access::texture_read, {"tile_lists", GL_RGBA32UI});
    if (options.residency) pass.read(gbuffer.hits, Access::storage_read, "Hits");
    const graph::BufferHandle records =
        pass.write(graph.create_buffer("debug records", {view.band.paths() * sizeof(shared::DebugRecord)}),
                   Access::storage_write, "Records");
    pass.execute([=](graph::Resources& r) {
        rays::RayBatch seen = shadow;
        seen.backfaces = view.pass_backs(rays::RayKind::primary);
        gpu::Defines defines = rays::tile_defines(view.trace, seen, view.tracer.tile_settings());
        const bool paged = view.trace.paged();
        if (options.nodes && !paged) defines.set("HALFLIGHT_COUNT");
        if (lists && view.tracer.ran_by_tiles(shadow)) defines.set("HALFLIGHT_TILE_LISTS");
        const bool residency = options.residency && paged;
        if (residency) defines.set("HALFLIGHT_RESIDENCY");
        view.trace.bind();
        view.scene.bind();
        const gpu::Program& program = r.kernel({"shaders/debug_aov.comp", defines});
        if (residency) program.set("top", view.trace.top());
        program.dispatch(view.band.paths() / 64);
    });
    return records;
}

}  // namespace halflight
