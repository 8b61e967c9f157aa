#include "passes/light/shadow.h"

#include "passes/steps/panes.h"
#include "shaders/shared/path_state.h"
#include "shaders/shared/ray_structs.h"

namespace halflight {

using graph::Access;

namespace {

/// Adds the light of the samples of each pixel to `light`, and returns its shadow rays. `kind` is shadow for chosen
/// lights, or sun.
rays::RayBatch add_samples(graph::Graph& graph, const SceneView& view, const GBuffer& g, rays::RayKind kind,
                           graph::BufferHandle& light) {
    const bool sun = kind == rays::RayKind::sun;
    const std::uint32_t count = shadow_batch(view, kind, {}).capacity;
    graph::Pass pass = graph.add_pass(sun ? "shadow: sample the sun" : "shadow: sample lights");
    view.read_frame(pass);
    pass.read(g.rays, Access::storage_read, "PrimaryRays");
    pass.read(g.surfaces, Access::texture_read, {"surfaces", GL_RGBA32F});
    const graph::BufferHandle shadow_rays =
        pass.write(graph.create_buffer(sun ? "sun rays" : "shadow rays", {count * sizeof(shared::Ray)}),
                   Access::storage_write, "ShadowRays");
    light = pass.write(light, partial_write(light), "Light");
    gpu::Defines defines = view.path_defines();
    defines.set("HALFLIGHT_SHADOW_RAYS", view.shadow_rays);
    if (sun) defines.set("HALFLIGHT_SUN_SAMPLES");
    pass.kernel({"shaders/shadow.comp", defines, view.bind_scene()});
    pass.execute([=](graph::Resources& r) { r.kernel().dispatch(count / 64); });

    return shadow_batch(view, kind, shadow_rays);
}

/// Traces shadow rays. Returns an answer for each ray.
graph::BufferHandle occlusion(graph::Graph& graph, const SceneView& view, const rays::RayBatch& batch,
                              const char* name) {
    return trace_shadow_rays(graph, view, batch, graph.create_buffer(name, {batch.capacity * sizeof(shared::uint)}));
}

}  // namespace

DirectLightEstimate add_shadow(graph::Graph& graph, const SceneView& view, const GBuffer& g) {
    const bool sun = view.scene.needs().sun;
    DirectLightEstimate direct;
    const std::size_t samples = (view.shadow_rays + (sun ? 1 : 0)) * std::size_t{view.band.paths()};
    direct.light = graph.create_buffer("direct light", {samples * sizeof(shared::DirectLight)});
    direct.rays = add_samples(graph, view, g, rays::RayKind::shadow, direct.light);
    direct.occluded = occlusion(graph, view, direct.rays, "occluded");
    if (!sun) return direct;
    direct.sun_rays = add_samples(graph, view, g, rays::RayKind::sun, direct.light);
    direct.sun_occluded = occlusion(graph, view, direct.sun_rays, "sun occluded");
    return direct;
}

}  // namespace halflight
