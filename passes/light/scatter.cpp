#include "passes/light/scatter.h"

#include "engine/paging/row_gather.h"
#include "passes/light/panes.h"
#include "shaders/shared/light.h"
#include "shaders/shared/path_state.h"
#include "shaders/shared/ray_structs.h"

namespace halflight {

using graph::Access;

PathBuffers create_path_buffers(graph::Graph& graph, const SceneView& view) {
    const std::size_t paths = view.band.paths();
    graph::BufferHandle receivers, met_lamps, cones, media;
    if (view.scene.needs().receivers())
        receivers = graph.create_buffer("path receivers", {paths * sizeof(shared::Receiver)});
    if (view.scene.needs().sized_lights())
        met_lamps = graph.create_buffer("path lamps", {paths * sizeof(shared::MetLamp)});
    if (view.scene.needs().texture_levels) cones = graph.create_buffer("path cones", {paths * sizeof(vec2)});
    if (view.scene.needs().volume) media = graph.create_buffer("path media", {paths * sizeof(vec4)});
    return {.rays = graph.create_buffer("path rays", {paths * sizeof(shared::Ray)}),
            .hits = graph.create_buffer("path hits", {paths * sizeof(shared::Hit)}),
            .states = graph.create_buffer("path states", {paths * sizeof(shared::PathState)}),
            .receivers = receivers,
            .met_lamps = met_lamps,
            .cones = cones,
            .media = media,
            .points = {},
            .sun_light = {},
            .cells = {},
            .group_light = {}};
}

PathList create_path_list(graph::Graph& graph, const SceneView& view, const std::string& name, std::size_t capacity) {
    if (capacity == 0) capacity = view.band.paths();
    PathList list;
    graph::Pass pass = graph.add_pass(name + ": clear list");
    list.list =
        pass.write(graph.create_buffer(name + " list", {capacity * sizeof(shared::uint)}), Access::transfer_write);
    list.header =
        pass.write(graph.create_buffer(name + " list header", {sizeof(shared::ListHeader)}), Access::transfer_write);
    pass.execute([list](graph::Resources& r) {
        const shared::ListHeader empty{.groups_x = 0, .groups_y = 1, .groups_z = 1, .count = 0};
        r.buffer(list.header).write(0, sizeof(empty), &empty);
    });
    return list;
}

void read_listed(graph::Pass& pass, const PathList& list, const PathBuffers& paths) {
    pass.read(list.list, Access::texture_read, {"list", GL_R32UI});
    pass.read(list.header, Access::indirect_read);
    pass.read(list.header, Access::texture_read, {"header", GL_RGBA32UI});
    pass.read(paths.rays, Access::texture_read, {"rays", GL_RGBA32F});
    pass.read(paths.hits, Access::texture_read, {"hits", GL_R32UI});
}

rays::RayBatch ray_batch(const SceneView& view, rays::RayKind kind, graph::BufferHandle rays, const PathList& list,
                         int depth) {
    // Camera rays have salt 0 (shaders/gbuffer.frag).
    const int of_depth = kind == rays::RayKind::shadow ? 1 : kind == rays::RayKind::sun ? 2 : 0;
    const auto salt = static_cast<std::uint32_t>(1 + 3 * depth + of_depth);
    return {.kind = kind,
            .depth = static_cast<std::uint32_t>(depth),
            .place = view.place,
            .capacity = view.band.paths(),
            .rays = rays,
            .list = list.list,
            .list_header = list.header,
            .frame_constants = view.frame_constants,
            .sampled_blocks = view.sampled_blocks,
            .alpha_salt = salt,
            .backfaces = view.pass_backs(kind),
            .passes_panes = view.passes_panes(kind)};
}

graph::BufferHandle add_resolve(graph::Graph& graph, const SceneView& view, const char* name, const PathList& list,
                                PathBuffers& paths, const ResolveOptions& options) {
    graph::Pass pass = graph.add_pass(name);
    view.read_frame(pass);
    read_listed(pass, list, paths);
    if (paths.cones) pass.read(paths.cones, Access::texture_read, {"cones", GL_RG32F});
    if (paths.media) pass.read(paths.media, Access::texture_read, {"media", GL_RGBA32F});
    const std::size_t bytes = view.band.paths() * view.scene.surface_record_bytes();
    const graph::BufferHandle surfaces =
        pass.write(graph.create_buffer("path surfaces", {bytes}), Access::storage_write, "Surfaces");
    if (options.reuse_points) paths.points = pass.write(paths.points, partial_write(paths.points), "Points");
    gpu::Defines defines = view.shading_defines();
    defines.set("HALFLIGHT_LIST");
    if (options.last) defines.set("HALFLIGHT_LAST_VERTEX");
    if (options.by_chance && view.scene.needs().panes) defines.set("HALFLIGHT_BY_CHANCE");
    if (options.reuse_points) defines.set("HALFLIGHT_REUSE_POINTS");
    if (view.rows) defines.set("HALFLIGHT_GATHERED_ROWS");
    pass.kernel({"shaders/resolve.comp", defines, view.bind_hits()});
    pass.execute([=, hits = paths.hits, header = list.header](graph::Resources& r) {
        if (view.rows) view.rows->gather(r.buffer(hits), r.buffer(list.list), r.buffer(header));
        const gpu::Program& program = r.kernel();
        view.shade(program, [&] { program.dispatch_indirect(r.buffer(header), view.band.paths() / 64); });
    });
    return surfaces;
}

PathList add_first_scatter(graph::Graph& graph, const SceneView& view, const GBuffer& g, const FirstScatter& what,
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

}  // namespace halflight
