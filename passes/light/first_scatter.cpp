#include "passes/light/first_scatter.h"

#include <string>

#include "passes/steps/panes.h"

namespace halflight {
namespace {

using graph::Access;

/// A component of the first surface's BSDF.
struct Component {
    const char* name;
    const char* kernel;
    rays::RayKind kind;
};

PathList add_component(graph::Graph& graph, const SceneView& view, const GBuffer& g, const Component& what,
                       PathBuffers& paths) {
    PathList list = create_path_list(graph, view, what.name);
    graph::Pass pass = graph.add_pass(std::string(what.name) + ": sample");
    view.read_frame(pass);
    pass.read(g.rays, Access::storage_read, "PrimaryRays");
    pass.read(g.surfaces, Access::texture_read, {"surfaces", GL_RGBA32F});
    const bool first = paths.states.version == 0;
    paths.rays = pass.write(paths.rays, partial_write(paths.rays), "PathRays");
    paths.states = pass.write(paths.states, partial_write(paths.states), "States");
    if (paths.receivers) paths.receivers = pass.write(paths.receivers, partial_write(paths.receivers), "Receivers");
    if (paths.cones) paths.cones = pass.write(paths.cones, partial_write(paths.cones), "Cones");
    if (paths.media) paths.media = pass.write(paths.media, partial_write(paths.media), "Media");
    list.list = pass.write(list.list, Access::storage_read_write, "List");
    list.header = pass.write(list.header, Access::storage_read_write, "Header");
    gpu::Defines defines = view.path_defines();
    if (first) defines.set("HALFLIGHT_FIRST_SCATTER");
    pass.kernel({what.kernel, defines, view.bind_scene()});
    pass.execute([=](graph::Resources& r) { r.kernel().dispatch(view.band.paths() / 64); });
    trace_scattered_rays(graph, view, ray_batch(view, what.kind, paths.rays, list, 0), paths);
    return list;
}

}  // namespace

PathList add_diffuse(graph::Graph& graph, const SceneView& view, const GBuffer& gbuffer, PathBuffers& paths) {
    return add_component(graph, view, gbuffer, {"diffuse", "shaders/diffuse.comp", rays::RayKind::diffuse}, paths);
}

PathList add_glossy(graph::Graph& graph, const SceneView& view, const GBuffer& gbuffer, PathBuffers& paths) {
    return add_component(graph, view, gbuffer, {"glossy", "shaders/glossy.comp", rays::RayKind::glossy}, paths);
}

}  // namespace halflight
