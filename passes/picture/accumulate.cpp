#include "passes/picture/accumulate.h"

#include <fmt/format.h>

#include <string>
#include <utility>
#include <vector>

#include "shaders/shared/bindings.h"

namespace halflight {

using graph::Access;

Accumulated add_accumulate(graph::Graph& graph, const SceneView& view, const SampleInputs& sample,
                           const AccumulateOptions& options, gpu::Buffer& bad_values) {
    const std::size_t paths = view.band.paths();
    graph::Pass pass = graph.add_pass("accumulate");
    gpu::Defines defines = view.scene.defines();
    pass.read(view.frame_constants, Access::uniform_read);
    pass.read(sample.gbuffer.surfaces, Access::storage_read);
    if (sample.direct) {
        pass.read(sample.direct->light, Access::storage_read);
        pass.read(sample.direct->occluded, Access::storage_read);
        if (sample.direct->sun_occluded) pass.read(sample.direct->sun_occluded, Access::storage_read);
        defines.set("HALFLIGHT_LIGHT_SAMPLES");
        defines.set("HALFLIGHT_SHADOW_RAYS", fmt::format("{}u", view.shadow_rays));
    }
    if (sample.paths) {
        pass.read(sample.paths->states, Access::storage_read);
        defines.set("HALFLIGHT_PATHS");
    }
    const bool indirect = sample.continuation && sample.continuation->indirect;
    if (indirect) defines.set("HALFLIGHT_INDIRECT");
    const bool clamped = indirect && options.clamp;
    if (clamped) defines.set("HALFLIGHT_CLAMP");
    const bool pending = indirect && sample.continuation->occluded;
    if (pending) {
        pass.read(sample.continuation->occluded, Access::storage_read);
        defines.set("HALFLIGHT_PENDING");
        if (sample.continuation->sun_occluded) {
            if (sample.paths->cells) defines.set("HALFLIGHT_RADIANCE_CACHE");
            pass.read(sample.continuation->sun_occluded, Access::storage_read);
            pass.read(sample.paths->sun_light, Access::storage_read);
        }
    }

    if (sample.seen) {
        pass.read(sample.seen, Access::storage_read);
        defines.set("HALFLIGHT_SEEN");
    }
    if (sample.received) {
        pass.read(sample.received, Access::storage_read);
        defines.set("HALFLIGHT_REUSE");
    }

    Accumulated out;
    std::vector<std::pair<GLuint, graph::BufferHandle>> sums;
    const auto keep = [&](const char* name, std::size_t doubles, GLuint binding) {
        const std::string own = view.sums == 0 ? name : fmt::format("{} {}", name, view.sums);
        const graph::BufferHandle before = graph.carried_buffer(own, {paths * doubles * sizeof(double)});
        return sums.emplace_back(binding, pass.write(before, Access::storage_read_write)).second;
    };
    out.emission = keep("emission sums", 4, 5);
    if (sample.direct || sample.paths) out.direct = keep("direct sums", 6, 6);
    if (indirect) out.indirect = keep("indirect sums", 6, 7);
    if (options.squares) {
        out.squares = keep("square sums", 3, 8);
        defines.set("HALFLIGHT_SQUARES");
    }
    if (options.features) {
        out.features = keep("feature sums", 6, 9);
        defines.set("HALFLIGHT_FEATURES");
    }
    out.bad_values = pass.write(graph.import_buffer("bad values", bad_values), Access::storage_read_write);

    pass.execute([=](graph::Resources& r) {
        r.buffer(view.frame_constants).bind_uniform(BLOCK_FRAME);
        r.buffer(sample.gbuffer.surfaces).bind_storage(0);
        if (sample.direct) {
            r.buffer(sample.direct->light).bind_storage(1);
            r.buffer(sample.direct->occluded).bind_storage(2);
            if (sample.direct->sun_occluded) r.buffer(sample.direct->sun_occluded).bind_storage(13);
        }
        if (sample.paths) r.buffer(sample.paths->states).bind_storage(3);
        if (pending) r.buffer(sample.continuation->occluded).bind_storage(4);
        if (pending && sample.continuation->sun_occluded) {
            r.buffer(sample.continuation->sun_occluded).bind_storage(14);
            r.buffer(sample.paths->sun_light).bind_storage(15);
        }
        for (const auto& [binding, handle] : sums) r.buffer(handle).bind_storage(binding);
        r.buffer(out.bad_values).bind_storage(10);
        if (sample.received) r.buffer(sample.received).bind_storage(11);
        if (sample.seen) r.buffer(sample.seen).bind_storage(12);
        const gpu::Program& program = r.programs().compute("shaders/accumulate.comp", defines);
        if (clamped) program.set("most_luminance", *options.clamp);
        program.dispatch(view.band.paths() / 64);
    });
    return out;
}

void read_light(graph::Pass& pass, gpu::Defines& defines, const Accumulated& sums) {
    pass.read(sums.emission, Access::storage_read);
    if (sums.direct) {
        pass.read(sums.direct, Access::storage_read);
        defines.set("HALFLIGHT_DIRECT");
    }
    if (sums.indirect) {
        pass.read(sums.indirect, Access::storage_read);
        defines.set("HALFLIGHT_INDIRECT");
    }
}

void bind_light(graph::Resources& r, const Accumulated& sums) {
    r.buffer(sums.emission).bind_storage(0);
    if (sums.direct) r.buffer(sums.direct).bind_storage(1);
    if (sums.indirect) r.buffer(sums.indirect).bind_storage(2);
}

}  // namespace halflight
