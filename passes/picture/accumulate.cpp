#include "passes/picture/accumulate.h"

#include <fmt/format.h>

#include <string>

#include "shaders/shared/chain_records.h"
#include "shaders/shared/denoise.h"

namespace halflight {

using graph::Access;

Accumulated add_accumulate(graph::Graph& graph, const SceneView& view, const SampleInputs& sample,
                           const AccumulateOptions& options, gpu::Buffer& bad_values) {
    const std::size_t paths = view.band.paths();
    graph::Pass pass = graph.add_pass("accumulate");
    gpu::Defines defines = view.camera_defines(view.path_defines());
    view.read_frame(pass);
    pass.read(sample.gbuffer.surfaces, Access::texture_read, {"surfaces", GL_RGBA32F});
    if (sample.direct) {
        pass.read(sample.direct->light, Access::texture_read, {"light", GL_RGBA32F});
        pass.read(sample.direct->occluded, Access::texture_read, {"occluded", GL_R32UI});
        if (sample.direct->sun_occluded)
            pass.read(sample.direct->sun_occluded, Access::texture_read, {"sun_occluded", GL_R32UI});
        defines.set("HALFLIGHT_LIGHT_SAMPLES");
        defines.set("HALFLIGHT_SHADOW_RAYS", view.shadow_rays);
    }
    if (sample.paths) {
        pass.read(sample.paths->states, Access::texture_read, {"states", GL_RGBA32UI});
        defines.set("HALFLIGHT_PATHS");
    }
    const bool indirect = sample.continuation && sample.continuation->indirect;
    if (indirect) defines.set("HALFLIGHT_INDIRECT");
    const bool clamped = indirect && options.clamp;
    if (clamped) defines.set("HALFLIGHT_CLAMP");
    const bool pending = indirect && sample.continuation->occluded;
    if (pending) {
        pass.read(sample.continuation->occluded, Access::texture_read, {"light_occluded", GL_R32UI});
        defines.set("HALFLIGHT_PENDING");
        if (sample.continuation->sun_occluded) {
            if (sample.paths->cells) defines.set("HALFLIGHT_RADIANCE_CACHE");
            pass.read(sample.continuation->sun_occluded, Access::texture_read, {"later_sun_occluded", GL_R32UI});
            pass.read(sample.paths->sun_light, Access::texture_read, {"sun_light", GL_RGBA32F});
        }
    }

    if (sample.seen) {
        pass.read(sample.seen, Access::texture_read, {"light_seen", GL_RGBA32F});
        defines.set("HALFLIGHT_SEEN");
    }
    if (sample.lamps) {
        pass.read(sample.lamps, Access::texture_read, {"light_seen", GL_RGBA32F});
        defines.set("HALFLIGHT_LAMPS_SEEN");
    }
    if (sample.received) {
        pass.read(sample.received, Access::texture_read, {"received", GL_RGBA32F});
        defines.set("HALFLIGHT_REUSE");
    }

    Accumulated out;
    const auto keep = [&](const char* name, std::size_t doubles, const char* block) {
        const std::string own = options.sums == 0 ? name : fmt::format("{} {}", name, options.sums);
        const graph::BufferHandle before = graph.carried_buffer(own, {paths * doubles * sizeof(double)});
        return pass.write(before, Access::storage_read_write, block);
    };
    out.emission = keep("emission sums", 4, "EmissionSums");
    if (sample.direct || sample.paths) out.direct = keep("direct sums", 6, "DirectSums");
    if (indirect) out.indirect = keep("indirect sums", 6, "IndirectSums");
    if (options.squares) {
        out.squares = keep("square sums", 3, "SquareSums");
        defines.set("HALFLIGHT_SQUARES");
    }
    if (view.light_groups > 0) {
        out.groups = keep("light group sums", 3 * std::size_t{view.light_groups}, "GroupSums");
        if (!sample.seen) pass.read(sample.gbuffer.hits, Access::texture_read, {"hits", GL_R32UI});
        if (sample.paths) pass.read(sample.paths->group_light, Access::texture_read, {"group_light", GL_RGBA32F});
        if (view.rows) defines.set("HALFLIGHT_SORTED_EMITTERS");
    }
    if (options.features) {
        out.features = keep("feature sums", 6, "FeatureSums");
        defines.set("HALFLIGHT_FEATURES");
    }
    if (options.halves) {
        out.halves = keep("half sums", shared::kHalfSums + (sample.chains ? shared::kChainSums : 0), "HalfSums");
        if (sample.chains) {
            pass.read(sample.chains, Access::texture_read, {"chains", GL_RGBA32F});
            defines.set("HALFLIGHT_SPECULAR_CHAINS");
        }
        defines.set("HALFLIGHT_HALVES");
    }
    out.bad_values = pass.write(graph.import_buffer("bad values", bad_values), Access::storage_read_write, "Counts");

    pass.kernel({"shaders/accumulate.comp", defines, view.bind_scene()});  // tables of lights, for groups
    pass.execute([=](graph::Resources& r) {
        const gpu::Program& program = r.kernel();
        if (clamped) program.set("most_luminance", *options.clamp);
        program.dispatch(view.band.paths() / 64);
    });
    return out;
}

}  // namespace halflight
