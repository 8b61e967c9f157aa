#include "passes/picture/shadow_catcher.h"

#include <fmt/format.h>

namespace halflight {

using graph::Access;

namespace {

/// Traces the occluded rays of catchers through all other surfaces. Returns the answers, like those of any_hit(): rays
/// that need none are free.
graph::BufferHandle occlusion_by_catchers(graph::Graph& graph, const SceneView& view, const GBuffer& g,
                                          rays::RayBatch batch, graph::BufferHandle occluded) {
    graph::Pass pass = graph.add_pass("shadow catchers: select rays");
    pass.read(view.frame_constants, Access::uniform_read, "FrameBlock");
    pass.read(g.surfaces, Access::texture_read, {"surfaces", GL_RGBA32F});
    pass.read(occluded, Access::texture_read, {"occluded", GL_R32UI});
    batch.rays = pass.write(batch.rays, Access::storage_read_write, "ShadowRays");
    batch.catchers_only = true;
    // The tracer reads the table of triangles.
    pass.kernel({"shaders/catcher_rays.comp", view.path_defines(), view.bind_scene()});
    pass.execute([paths = view.band.paths(), rays = batch.capacity](graph::Resources& r) {
        const gpu::Program& program = r.kernel();
        program.set("paths", paths);
        program.dispatch(rays / 64);
    });
    return rays::any_hit(graph, view.trace, batch,
                         graph.create_buffer("occluded by catchers", {batch.capacity * sizeof(shared::uint)}));
}

}  // namespace

CatcherOcclusion add_catcher_occlusion(graph::Graph& graph, const SceneView& view, const SampleInputs& sample) {
    if (!sample.direct) return {};
    const DirectLightEstimate& direct = *sample.direct;
    CatcherOcclusion by;
    by.lights = occlusion_by_catchers(graph, view, sample.gbuffer, direct.rays, direct.occluded);
    if (direct.sun_occluded)
        by.sun = occlusion_by_catchers(graph, view, sample.gbuffer, direct.sun_rays, direct.sun_occluded);
    return by;
}

void add_shadow_catchers(graph::Graph& graph, const SceneView& view, const SampleInputs& sample,
                         const CatcherOcclusion& occlusion, std::uint32_t index, Accumulated& sums) {
    graph::Pass pass = graph.add_pass("shadow catchers: accumulate");
    gpu::Defines defines = view.path_defines();
    view.read_frame(pass);
    pass.read(sample.gbuffer.surfaces, Access::texture_read, {"surfaces", GL_RGBA32F});
    if (sample.direct) {
        pass.read(sample.direct->light, Access::texture_read, {"light", GL_RGBA32F});
        pass.read(sample.direct->occluded, Access::texture_read, {"occluded", GL_R32UI});
        pass.read(occlusion.lights, Access::texture_read, {"by_catchers", GL_R32UI});
        if (occlusion.sun) {
            pass.read(sample.direct->sun_occluded, Access::texture_read, {"sun_occluded", GL_R32UI});
            pass.read(occlusion.sun, Access::texture_read, {"sun_by_catchers", GL_R32UI});
        }
        defines.set("HALFLIGHT_LIGHT_SAMPLES");
        defines.set("HALFLIGHT_SHADOW_RAYS", view.shadow_rays);
    }
    const std::string name = index == 0 ? "catcher sums" : fmt::format("catcher sums {}", index);
    const std::size_t bytes = view.band.paths() * kCatcherSums * sizeof(double);
    sums.catchers = pass.write(graph.carried_buffer(name, {bytes}), Access::storage_read_write, "CatcherSums");
    sums.bad_values = pass.write(sums.bad_values, Access::storage_read_write, "Counts");
    pass.kernel({"shaders/catcher_sums.comp", defines});
    pass.execute([groups = view.band.paths() / 64](graph::Resources& r) { r.kernel().dispatch(groups); });
}

}  // namespace halflight
