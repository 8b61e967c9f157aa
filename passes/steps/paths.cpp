#include "passes/steps/paths.h"

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

rays::RayBatch shadow_batch(const SceneView& view, rays::RayKind kind, graph::BufferHandle rays) {
    // Without a list, the rays of a pixel keep their place in a tile. The tile's visibility state stays useful.
    rays::RayBatch batch = ray_batch(view, kind, rays, {}, 0);
    batch.paths = view.band.paths();
    batch.capacity = (kind == rays::RayKind::sun ? 1 : view.shadow_rays) * batch.paths;
    return batch;
}

}  // namespace halflight
