#include "passes/light/specular_chain.h"

#include <algorithm>

#include "passes/steps/resolve.h"
#include "shaders/shared/chain_records.h"
#include "shaders/shared/ray_structs.h"

namespace halflight {

using graph::Access;

SpecularChains add_specular_chains(graph::Graph& graph, const SceneView& view, const GBuffer& gbuffer,
                                   const SpecularChainOptions& options) {
    const std::size_t count = view.band.paths();
    const SceneNeeds& needs = view.scene.needs();
    const auto create = [&](const char* name, std::size_t bytes) { return graph.create_buffer(name, {count * bytes}); };
    PathBuffers paths;
    paths.rays = create("chain rays", sizeof(shared::Ray));
    paths.hits = create("chain hits", sizeof(shared::Hit));
    if (needs.texture_levels) paths.cones = create("chain cones", sizeof(vec2));
    if (needs.volume) paths.media = create("chain media", sizeof(vec4));
    SpecularChains out{create("specular chains", sizeof(shared::SpecularChain)), {}};
    if (options.places) out.places = create("chain places", sizeof(shared::ChainPlace));

    const int vertices = std::min(options.bounces, shared::kMostChainBounces);
    PathList arriving;
    for (int depth = 0; depth <= vertices; ++depth) {
        const bool begins = depth == 0, last = depth == vertices;
        PathList leaving;
        if (!last) leaving = create_path_list(graph, view, "specular chain");
        const graph::BufferHandle surfaces =
            begins ? gbuffer.surfaces : add_resolve(graph, view, "specular chain: resolve", arriving, paths);
        graph::Pass pass = graph.add_pass("specular chain: vertex");
        gpu::Defines defines = view.camera_defines(view.path_defines());
        const auto update = [&](graph::BufferHandle& buffer, const char* block) {
            buffer = pass.write(buffer, partial_write(buffer), block);
        };
        view.read_frame(pass);
        pass.read(surfaces, Access::texture_read, {"surfaces", GL_RGBA32F});
        update(out.chains, "Chains");
        update(paths.rays, "PathRays");
        if (options.places) {
            update(out.places, "Places");
            defines.set("HALFLIGHT_CHAIN_PLACES");
        }
        if (begins) {
            defines.set("HALFLIGHT_CHAIN_BEGINS");
        } else {
            pass.read(arriving.list, Access::texture_read, {"arriving", GL_R32UI});
            pass.read(arriving.header, Access::indirect_read);
            pass.read(arriving.header, Access::texture_read, {"arriving_header", GL_RGBA32UI});
            pass.read(paths.hits, Access::texture_read, {"hits", GL_R32UI});
        }
        if (last) {
            defines.set("HALFLIGHT_LAST_VERTEX");
        } else {
            if (paths.cones) update(paths.cones, "Cones");
            if (paths.media) update(paths.media, "Media");
            leaving.list = pass.write(leaving.list, Access::storage_read_write, "Leaving");
            leaving.header = pass.write(leaving.header, Access::storage_read_write, "LeavingHeader");
        }
        pass.kernel({"shaders/specular_chain.comp", defines, view.bind_scene()});
        pass.execute([=, header = arriving.header](graph::Resources& r) {
            const gpu::Program& program = r.kernel();
            program.set("depth", static_cast<std::uint32_t>(depth));
            if (begins)
                program.dispatch(view.band.paths() / 64);
            else
                program.dispatch_indirect(r.buffer(header), view.band.paths() / 64);
        });
        if (last) break;
        const rays::RayBatch batch = ray_batch(view, rays::RayKind::specular, paths.rays, leaving, depth);
        paths.hits = rays::closest_hit(graph, view.tracer, batch, paths.hits);
        arriving = leaving;
    }
    return out;
}

}  // namespace halflight
