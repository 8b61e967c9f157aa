#include "passes/shadow.h"

#include "passes/scatter.h"
#include "shaders/shared/bindings.h"
#include "shaders/shared/path.h"
#include "shaders/shared/rays.h"

namespace halflight {

using graph::Access;

DirectLightEstimate add_shadow(graph::Graph& graph, const SceneView& view, const GBuffer& g) {
    const std::size_t paths = view.band.paths();
    DirectLightEstimate direct;

    graph::Pass pass = graph.add_pass("shadow: sample lights");
    pass.read(view.frame_constants, Access::uniform_read);
    pass.read(g.rays, Access::storage_read);
    pass.read(g.surfaces, Access::storage_read);
    const graph::BufferHandle shadow_rays =
        pass.write(graph.create_buffer("shadow rays", {paths * sizeof(shared::Ray)}), Access::storage_write);
    direct.light =
        pass.write(graph.create_buffer("direct light", {paths * sizeof(shared::DirectLight)}), Access::storage_write);
    pass.execute([=](graph::Resources& r) {
        r.buffer(view.frame_constants).bind_uniform(BLOCK_FRAME);
        r.buffer(g.rays).bind_storage(0);
        r.buffer(g.surfaces).bind_storage(1);
        r.buffer(shadow_rays).bind_storage(2);
        r.buffer(direct.light).bind_storage(3);
        view.trace.bind();
        view.scene.bind();
        r.programs()
            .compute("shaders/shadow.comp", view.scene.defines())
            .dispatch(static_cast<std::uint32_t>(paths / 64));
    });

    // No list: the rays of a pixel keep their place in a tile, and what is known of the tile its use.
    direct.occluded = rays::any_hit(graph, view.tracer, ray_batch(view, rays::RayKind::shadow, shadow_rays, {}, 0),
                                    graph.create_buffer("occluded", {paths * sizeof(shared::uint)}));
    return direct;
}

}  // namespace halflight
