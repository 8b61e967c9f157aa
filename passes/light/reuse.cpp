#include "passes/light/reuse.h"

#include <epoxy/gl.h>
#include <fmt/format.h>

#include <algorithm>

#include "engine/rays/tiles.h"
#include "shaders/shared/path_state.h"
#include "shaders/shared/ray_structs.h"

namespace halflight {
namespace {

using graph::Access;

/// Rays towards all points, and the density with which each would have found its point.
struct Connections {
    graph::BufferHandle rays;       // one Ray per connection
    graph::BufferHandle densities;  // one float per connection
    graph::BufferHandle occluded;   // one uint per connection: answer of any_hit()
};

/// Inputs of both kernels.
struct GroupInputs {
    SceneView view;
    std::uint32_t group_size;
    graph::BufferHandle primary_rays, surfaces, states, points, occluded, sun_occluded, sun_light, group_light;

    void declare(graph::Pass& pass) const {
        pass.read(view.frame_constants, Access::uniform_read, "FrameBlock");
        pass.read(primary_rays, Access::storage_read, "PrimaryRays");
        pass.read(surfaces, Access::texture_read, {"surfaces", GL_RGBA32F});
        pass.read(states, Access::texture_read, {"states", GL_RGBA32UI});
        pass.read(points, Access::texture_read, {"points", GL_RGBA32F});
        if (occluded) pass.read(occluded, Access::texture_read, {"occluded", GL_R32UI});
        if (group_light) pass.read(group_light, Access::texture_read, {"group_light", GL_RGBA32F});
        if (!sun_occluded) return;
        pass.read(sun_occluded, Access::texture_read, {"sun_occluded", GL_R32UI});
        pass.read(sun_light, Access::texture_read, {"sun_light", GL_RGBA32F});
    }
    void run(graph::Pass& pass, const char* kernel) const {
        pass.kernel({kernel, defines(), view.bind_scene()});
        pass.execute([groups = view.band.paths() / 256](graph::Resources& r) { r.kernel().dispatch(groups); });
    }
    gpu::Defines defines() const {
        gpu::Defines defines = view.path_defines();
        if (occluded) defines.set("HALFLIGHT_PENDING");
        defines.set("HALFLIGHT_REUSE");
        defines.set("HALFLIGHT_GROUP_SIZE", group_size);
        return defines;
    }
};

Connections connect(graph::Graph& graph, const GroupInputs& inputs) {
    const SceneView& view = inputs.view;
    const std::uint32_t count = view.band.paths() * inputs.group_size;
    Connections c;
    graph::Pass pass = graph.add_pass("reuse: connect");
    inputs.declare(pass);
    c.rays = pass.write(graph.create_buffer("connection rays", {count * sizeof(shared::Ray)}), Access::storage_write,
                        "Connections");
    c.densities = pass.write(graph.create_buffer("connection densities", {count * sizeof(float)}),
                             Access::storage_write, "Densities");
    inputs.run(pass, "shaders/reuse_connect.comp");
    // There is no list. The rays towards a point follow one another and are culled as one set; those of small groups
    // share a set with the next points.
    rays::RayBatch batch = ray_batch(view, rays::RayKind::connection, c.rays, {}, 0);
    batch.capacity = count;
    batch.rays_of_path = inputs.group_size;
    c.occluded = rays::any_hit(graph, view.tracer, batch,
                               graph.create_buffer("connections occluded", {count * sizeof(shared::uint)}));
    return c;
}

}  // namespace

graph::BufferHandle create_reuse_points(graph::Graph& graph, const SceneView& view) {
    return graph.create_buffer("reuse points", {view.band.paths() * view.scene.needs().reuse_point_bytes()});
}

graph::BufferHandle add_reuse(graph::Graph& graph, const SceneView& view, const GBuffer& g, const PathBuffers& paths,
                              const Continuation& continuation, std::uint32_t group_size) {
    const GroupInputs inputs{view,
                             group_size,
                             g.rays,
                             g.surfaces,
                             paths.states,
                             paths.points,
                             continuation.occluded,
                             continuation.sun_occluded,
                             continuation.sun_occluded ? paths.sun_light : graph::BufferHandle{},
                             paths.group_light};
    const Connections c = connect(graph, inputs);
    graph::Pass pass = graph.add_pass("reuse: gather");
    inputs.declare(pass);
    pass.read(c.occluded, Access::texture_read, {"blocked", GL_R32UI});
    pass.read(c.densities, Access::storage_read, "Densities");
    const graph::BufferHandle received = pass.write(
        graph.create_buffer("light received",
                            {(1 + view.light_groups) * std::size_t{view.band.paths()} * sizeof(shared::DirectLight)}),
        Access::storage_write, "Received");
    inputs.run(pass, "shaders/reuse_gather.comp");
    return received;
}

}  // namespace halflight
