#include "passes/light/continuation.h"

#include <fmt/format.h>

#include "shaders/shared/bindings.h"
#include "shaders/shared/path.h"
#include "shaders/shared/rays.h"

namespace halflight {
namespace {

using graph::Access;

/// Buffers that all bounces share.
struct Shadowing {
    graph::BufferHandle rays;          // of the light samples
    graph::BufferHandle occluded;      // their answers
    graph::BufferHandle sun_rays;      // of those of the sun
    graph::BufferHandle sun_occluded;  // their answers
    bool answered() const { return occluded.version != 0; }
};

/// One vertex of the paths in `arriving`: light met and light sampled are added, and where `leaving` is given, rays are
/// sent on.
void add_vertex(graph::Graph& graph, const SceneView& view, int depth, const PathList& arriving, PathBuffers& paths,
                Shadowing& shadowing, PathList* lit, PathList* leaving) {
    const bool last = leaving == nullptr;
    const bool samples_lights = lit != nullptr;
    graph::Pass pass = graph.add_pass(last ? "continuation: last vertex" : "continuation: vertex");
    pass.read(view.frame_constants, Access::uniform_read);
    pass.read(arriving.list, Access::storage_read);
    pass.read(arriving.header, Access::indirect_read);
    pass.read(arriving.header, Access::storage_read);
    pass.read(paths.hits, Access::storage_read);
    paths.states = pass.write(paths.states, Access::storage_read_write);
    if (paths.receivers) {
        if (last)
            pass.read(paths.receivers, Access::storage_read);
        else
            paths.receivers = pass.write(paths.receivers, Access::storage_read_write);
    }
    if (paths.points) paths.points = pass.write(paths.points, partial_write(paths.points));
    const bool asks = paths.cells && depth == 1;  // for cells
    const bool takes = paths.cells && depth == 2 && !last;
    if (takes) pass.read(paths.cells, Access::texture_read);
    if (asks) paths.cells = pass.write(paths.cells, Access::storage_read_write);
    const graph::BufferHandle answered = shadowing.occluded;
    const bool pending = shadowing.answered();
    const graph::BufferHandle sun_answered = shadowing.sun_occluded;
    const bool sun = view.scene.needs().sun && (pending || samples_lights);
    if (pending) pass.read(answered, Access::storage_read);
    if (pending && sun) pass.read(sun_answered, Access::storage_read);
    if (sun && samples_lights)
        paths.sun_light = pass.write(paths.sun_light, partial_write(paths.sun_light));
    else if (sun)
        pass.read(paths.sun_light, Access::storage_read);
    if (last) {
        pass.read(paths.rays, Access::storage_read);
    } else {
        paths.rays = pass.write(paths.rays, Access::storage_read_write);
        if (samples_lights) shadowing.rays = pass.write(shadowing.rays, partial_write(shadowing.rays));
        if (samples_lights && sun)
            shadowing.sun_rays = pass.write(shadowing.sun_rays, partial_write(shadowing.sun_rays));
        for (PathList* list : {lit, leaving}) {
            if (!list) continue;
            list->list = pass.write(list->list, Access::storage_read_write);
            list->header = pass.write(list->header, Access::storage_read_write);
        }
    }
    gpu::Defines defines = view.scene.defines();
    if (pending) defines.set("HALFLIGHT_PENDING");
    if (last) defines.set("HALFLIGHT_LAST_VERTEX");
    if (samples_lights) defines.set("HALFLIGHT_LIGHT_SAMPLES");
    if (depth == 1) {
        defines.set("HALFLIGHT_FIRST_HIT");
        defines.set("HALFLIGHT_SHADOW_RAYS", fmt::format("{}u", view.shadow_rays));
    }
    if (takes) defines.set("HALFLIGHT_CACHE_TAKEN");
    if (paths.points) defines.set(paths.cells ? "HALFLIGHT_RADIANCE_CACHE" : "HALFLIGHT_REUSE");
    pass.execute([=, shadow_rays = shadowing.rays, sun_rays = shadowing.sun_rays, lit_list = lit ? *lit : PathList{},
                  next = leaving ? *leaving : PathList{}](graph::Resources& r) {
        r.buffer(view.frame_constants).bind_uniform(BLOCK_FRAME);
        r.buffer(arriving.list).bind_storage(0);
        r.buffer(arriving.header).bind_storage(1);
        r.buffer(paths.rays).bind_storage(2);
        r.buffer(paths.hits).bind_storage(3);
        r.buffer(paths.states).bind_storage(4);
        if (pending) r.buffer(answered).bind_storage(5);
        if (pending && sun) r.buffer(sun_answered).bind_storage(13);
        if (samples_lights && sun) r.buffer(sun_rays).bind_storage(14);
        if (sun) r.buffer(paths.sun_light).bind_storage(15);
        if (paths.receivers) r.buffer(paths.receivers).bind_storage(11);
        if (paths.points) r.buffer(paths.points).bind_storage(12);
        if (asks) r.buffer(paths.cells).bind_storage(13);
        if (takes) r.buffer(paths.cells).bind_texture(UNIT_FREE, GL_R32UI);
        if (samples_lights) {
            r.buffer(shadow_rays).bind_storage(6);
            r.buffer(lit_list.list).bind_storage(7);
            r.buffer(lit_list.header).bind_storage(8);
        }
        if (!last) {
            r.buffer(next.list).bind_storage(9);
            r.buffer(next.header).bind_storage(10);
        }
        view.trace.bind();
        view.scene.bind();
        const gpu::Program& program = r.programs().compute("shaders/continuation.comp", defines);
        program.set("depth", static_cast<std::uint32_t>(depth));
        program.dispatch_indirect(r.buffer(arriving.header));
    });
}

}  // namespace

Continuation add_continuation(graph::Graph& graph, const SceneView& view, const std::vector<PathList>& batches,
                              const ContinuationOptions& options, PathBuffers& paths) {
    const std::size_t capacity = view.band.paths();
    Shadowing shadowing{graph.create_buffer("light sample rays", {capacity * sizeof(shared::Ray)}),
                        graph.create_buffer("light sample occluded", {capacity * sizeof(shared::uint)}),
                        {},
                        {}};
    const bool sun = view.scene.needs().sun && options.light_samples && options.bounces > 1;
    if (sun) {
        shadowing.sun_rays = graph.create_buffer("sun sample rays", {capacity * sizeof(shared::Ray)});
        shadowing.sun_occluded = graph.create_buffer("sun sample occluded", {capacity * sizeof(shared::uint)});
        paths.sun_light = graph.create_buffer("sun samples", {(paths.points ? 2 : 1) * capacity * sizeof(vec4)});
    }
    std::vector<PathList> arriving = batches;
    for (int depth = 1; depth < options.bounces; ++depth) {
        PathList leaving = create_path_list(graph, view, "continuation");
        if (options.light_samples) {
            PathList lit = create_path_list(graph, view, "light samples");
            for (const PathList& batch : arriving)
                add_vertex(graph, view, depth, batch, paths, shadowing, &lit, &leaving);
            shadowing.occluded =
                rays::any_hit(graph, view.tracer, ray_batch(view, rays::RayKind::shadow, shadowing.rays, lit, depth),
                              shadowing.occluded);
            if (sun)
                shadowing.sun_occluded = rays::any_hit(
                    graph, view.tracer, ray_batch(view, rays::RayKind::sun, shadowing.sun_rays, lit, depth),
                    shadowing.sun_occluded);
        } else {
            for (const PathList& batch : arriving)
                add_vertex(graph, view, depth, batch, paths, shadowing, nullptr, &leaving);
        }
        paths.hits = rays::closest_hit(
            graph, view.tracer, ray_batch(view, rays::RayKind::continuation, paths.rays, leaving, depth), paths.hits);
        arriving = {leaving};
    }
    for (const PathList& batch : arriving)
        add_vertex(graph, view, options.bounces, batch, paths, shadowing, nullptr, nullptr);
    const bool pending = shadowing.answered();
    return {pending ? shadowing.occluded : graph::BufferHandle{},
            pending ? shadowing.sun_occluded : graph::BufferHandle{}, options.bounces > 1};
}

}  // namespace halflight
