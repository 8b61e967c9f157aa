#include "passes/light/continuation.h"

#include "passes/steps/panes.h"
#include "passes/steps/resolve.h"
#include "shaders/shared/path_state.h"
#include "shaders/shared/ray_structs.h"

namespace halflight {
namespace {

using graph::Access;

/// Buffers that all bounces share.
struct Shadowing {
    graph::BufferHandle rays;          // shadow rays of the light samples
    graph::BufferHandle occluded;      // answers to `rays`
    graph::BufferHandle sun_rays;      // shadow rays of the sun samples
    graph::BufferHandle sun_occluded;  // answers to `sun_rays`
    bool answered() const { return occluded.version != 0; }
};

/// Shades one vertex of the paths in `arriving`. Light met and light sampled are added; if `leaving` is given, rays
/// are sent on.
void add_vertex(graph::Graph& graph, const SceneView& view, int depth, const PathList& arriving, PathBuffers& paths,
                Shadowing& shadowing, PathList* lit, PathList* leaving) {
    const bool last = leaving == nullptr;
    const bool samples_lights = lit != nullptr;
    const bool reuse = paths.points && !paths.cells;
    const graph::BufferHandle surfaces =
        add_resolve(graph, view, "continuation: resolve", arriving, paths, {last, true, reuse && depth == 1 && !last});
    graph::Pass pass = graph.add_pass(last ? "continuation: last vertex" : "continuation: vertex");
    view.read_frame(pass);
    pass.read(arriving.list, Access::texture_read, {"arriving", GL_R32UI});
    pass.read(arriving.header, Access::indirect_read);
    pass.read(arriving.header, Access::texture_read, {"arriving_header", GL_RGBA32UI});
    pass.read(paths.hits, Access::texture_read, {"hits", GL_R32UI});
    pass.read(surfaces, Access::texture_read, {"surfaces", GL_RGBA32F});
    paths.states = pass.write(paths.states, Access::storage_read_write, "States");
    if (paths.receivers) {
        if (last)
            pass.read(paths.receivers, Access::storage_read, "Receivers");
        else
            paths.receivers = pass.write(paths.receivers, Access::storage_read_write, "Receivers");
    }
    if (paths.met_lamps) pass.read(paths.met_lamps, Access::texture_read, {"met_lamps", GL_RGBA32F});
    if (paths.cones && !last) paths.cones = pass.write(paths.cones, Access::storage_read_write, "Cones");
    if (paths.media && !last) paths.media = pass.write(paths.media, Access::storage_read_write, "Media");
    if (paths.group_light)
        paths.group_light = pass.write(paths.group_light, partial_write(paths.group_light), "GroupLight");
    if (paths.points) paths.points = pass.write(paths.points, partial_write(paths.points), "Points");
    const bool asks = paths.cells && depth == 1;  // vertex 1 asks for cells
    const bool takes = paths.cells && depth == 2 && !last;
    if (takes) pass.read(paths.cells, Access::texture_read, {"cell_words", GL_R32UI});
    if (asks) paths.cells = pass.write(paths.cells, Access::storage_read_write, "Cells");
    const bool pending = shadowing.answered();
    const bool sun = view.scene.needs().sun && (pending || samples_lights);
    if (pending) pass.read(shadowing.occluded, Access::texture_read, {"occluded", GL_R32UI});
    if (pending && sun) pass.read(shadowing.sun_occluded, Access::texture_read, {"sun_occluded", GL_R32UI});
    if (sun && samples_lights)
        paths.sun_light = pass.write(paths.sun_light, partial_write(paths.sun_light), "SunLight");
    else if (sun)
        pass.read(paths.sun_light, Access::storage_read, "SunLight");
    if (last) {
        pass.read(paths.rays, Access::storage_read, "PathRays");
    } else {
        paths.rays = pass.write(paths.rays, Access::storage_read_write, "PathRays");
        leaving->list = pass.write(leaving->list, Access::storage_read_write, "Leaving");
        leaving->header = pass.write(leaving->header, Access::storage_read_write, "LeavingHeader");
    }
    if (samples_lights) {
        shadowing.rays = pass.write(shadowing.rays, partial_write(shadowing.rays), "ShadowRays");
        if (sun) shadowing.sun_rays = pass.write(shadowing.sun_rays, partial_write(shadowing.sun_rays), "SunRays");
        lit->list = pass.write(lit->list, Access::storage_read_write, "Lit");
        lit->header = pass.write(lit->header, Access::storage_read_write, "LitHeader");
    }
    gpu::Defines defines = view.path_defines();
    if (view.rows) defines.set("HALFLIGHT_SORTED_EMITTERS");
    if (pending) defines.set("HALFLIGHT_PENDING");
    if (last) defines.set("HALFLIGHT_LAST_VERTEX");
    if (samples_lights) defines.set("HALFLIGHT_LIGHT_SAMPLES");
    if (depth == 1) {
        defines.set("HALFLIGHT_FIRST_HIT");
        defines.set("HALFLIGHT_SHADOW_RAYS", view.shadow_rays);
    }
    if (asks) defines.set("HALFLIGHT_CACHE_ASKED");
    if (takes) defines.set("HALFLIGHT_CACHE_TAKEN");
    if (paths.points) defines.set(reuse ? "HALFLIGHT_REUSE" : "HALFLIGHT_RADIANCE_CACHE");
    pass.kernel({"shaders/continuation.comp", defines, view.bind_scene()});
    pass.execute([=, header = arriving.header](graph::Resources& r) {
        const gpu::Program& program = r.kernel();
        program.set("depth", static_cast<std::uint32_t>(depth));
        program.dispatch_indirect(r.buffer(header), view.band.paths() / 64);
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
            shadowing.occluded = trace_shadow_rays(
                graph, view, ray_batch(view, rays::RayKind::shadow, shadowing.rays, lit, depth), shadowing.occluded);
            if (sun)
                shadowing.sun_occluded =
                    trace_shadow_rays(graph, view, ray_batch(view, rays::RayKind::sun, shadowing.sun_rays, lit, depth),
                                      shadowing.sun_occluded);
        } else {
            for (const PathList& batch : arriving)
                add_vertex(graph, view, depth, batch, paths, shadowing, nullptr, &leaving);
        }
        trace_scattered_rays(graph, view, ray_batch(view, rays::RayKind::continuation, paths.rays, leaving, depth),
                             paths);
        arriving = {leaving};
    }
    for (const PathList& batch : arriving)
        add_vertex(graph, view, options.bounces, batch, paths, shadowing, nullptr, nullptr);
    const bool pending = shadowing.answered();
    return {pending ? shadowing.occluded : graph::BufferHandle{},
            pending ? shadowing.sun_occluded : graph::BufferHandle{}, options.bounces > 1};
}

}  // namespace halflight
