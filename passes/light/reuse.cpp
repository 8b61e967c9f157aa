#include "passes/light/reuse.h"

#include <epoxy/gl.h>
#include <fmt/format.h>

#include <algorithm>

#include "engine/rays/tiles.h"
#include "shaders/shared/bindings.h"
#include "shaders/shared/path.h"
#include "shaders/shared/rays.h"
#include "shaders/shared/reuse.h"

namespace halflight {
namespace {

using graph::Access;

/// Rays towards all points, and how likely each would have found its point.
struct Connections {
    graph::BufferHandle rays;       // Ray
    graph::BufferHandle densities;  // float
    graph::BufferHandle occluded;   // uint: answers
};

/// What both kernels read, from binding 0 on.
struct GroupInputs {
    SceneView view;
    graph::BufferHandle primary_rays, surfaces, states, points, occluded, sun_occluded, sun_light;

    void declare(graph::Pass& pass) const {
        for (const graph::BufferHandle& read : {primary_rays, surfaces, states, occluded, sun_occluded, sun_light})
            if (read) pass.read(read, Access::storage_read);
        pass.read(points, Access::texture_read);
        pass.read(view.frame_constants, Access::uniform_read);
    }
    void bind(graph::Resources& r) const {
        GLuint binding = 0;
        for (const graph::BufferHandle& read : {primary_rays, surfaces, states, occluded}) {
            if (read) r.buffer(read).bind_storage(binding);
            ++binding;
        }
        if (sun_occluded) {
            r.buffer(sun_occluded).bind_storage(7);
            r.buffer(sun_light).bind_storage(8);
        }
        r.buffer(view.frame_constants).bind_uniform(BLOCK_FRAME);
        view.trace.bind();
        view.scene.bind();
        r.buffer(points).bind_texture(UNIT_FREE, GL_RGBA32F);
    }
    gpu::Defines defines() const {
        gpu::Defines defines = view.scene.defines();
        if (occluded) defines.set("HALFLIGHT_PENDING");
        defines.set("HALFLIGHT_REUSE");
        defines.set("HALFLIGHT_GROUP_SIZE", fmt::format("{}u", view.group_size));
        return defines;
    }
};

std::uint32_t connection_count(const SceneView& view) {
    return view.band.paths() * view.group_size;
}

Connections connect(graph::Graph& graph, const GroupInputs& inputs) {
    const SceneView& view = inputs.view;
    const std::uint32_t count = connection_count(view);
    Connections c;
    graph::Pass pass = graph.add_pass("reuse: connect");
    inputs.declare(pass);
    c.rays = pass.write(graph.create_buffer("connection rays", {count * sizeof(shared::Ray)}), Access::storage_write);
    c.densities =
        pass.write(graph.create_buffer("connection densities", {count * sizeof(float)}), Access::storage_write);
    pass.execute([=](graph::Resources& r) {
        inputs.bind(r);
        r.buffer(c.rays).bind_storage(4);
        r.buffer(c.densities).bind_storage(5);
        r.programs().compute("shaders/reuse_connect.comp", inputs.defines()).dispatch(view.band.paths() / 256);
    });
    // No list: the rays towards a point follow one another, and are culled as one set, those of small groups with those
    // towards the next points.
    rays::RayBatch batch = ray_batch(view, rays::RayKind::connection, c.rays, {}, 0);
    batch.capacity = count;
    batch.rays_of_path = view.group_size;
    c.occluded = rays::any_hit(graph, view.tracer, batch,
                               graph.create_buffer("connections occluded", {count * sizeof(shared::uint)}));
    return c;
}

}  // namespace

graph::BufferHandle create_reuse_points(graph::Graph& graph, const SceneView& view) {
    return graph.create_buffer("reuse points", {view.band.paths() * sizeof(shared::ReusePoint)});
}

graph::BufferHandle add_reuse(graph::Graph& graph, const SceneView& view, const GBuffer& g, const PathBuffers& paths,
                              const Continuation& continuation) {
    const GroupInputs inputs{view,
                             g.rays,
                             g.surfaces,
                             paths.states,
                             paths.points,
                             continuation.occluded,
                             continuation.sun_occluded,
                             continuation.sun_occluded ? paths.sun_light : graph::BufferHandle{}};
    const Connections c = connect(graph, inputs);
    graph::Pass pass = graph.add_pass("reuse: gather");
    inputs.declare(pass);
    pass.read(c.occluded, Access::storage_read);
    pass.read(c.densities, Access::storage_read);
    const graph::BufferHandle received =
        pass.write(graph.create_buffer("light received", {view.band.paths() * sizeof(shared::DirectLight)}),
                   Access::storage_write);
    pass.execute([=](graph::Resources& r) {
        inputs.bind(r);
        r.buffer(c.occluded).bind_storage(4);
        r.buffer(c.densities).bind_storage(5);
        r.buffer(received).bind_storage(6);
        r.programs().compute("shaders/reuse_gather.comp", inputs.defines()).dispatch(view.band.paths() / 256);
    });
    return received;
}

}  // namespace halflight
