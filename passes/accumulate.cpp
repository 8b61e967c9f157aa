#include "passes/accumulate.h"

#include "shaders/shared/bindings.h"

namespace halflight {

using graph::Access;

namespace {

/// A history pair whose previous sums the pass reads and whose new ones it writes, bound one after the other.
struct Sums {
    graph::HistoryPair<graph::BufferHandle> pair;
    GLuint binding = 0;

    Sums(graph::Graph& graph, graph::Pass& pass, const char* name, std::size_t bytes, GLuint at)
        : pair(graph.history_buffer(name, {bytes})), binding(at) {
        pass.read(pair.previous, Access::storage_read);
        pair.now = pass.write(pair.now, Access::storage_write);
    }
    void bind(graph::Resources& r) const {
        r.buffer(pair.previous).bind_storage(binding);
        r.buffer(pair.now).bind_storage(binding + 1);
    }
};

}  // namespace

Accumulated add_accumulate(graph::Graph& graph, const SceneView& view, const SampleInputs& sample,
                           const AccumulateOptions& options, gpu::Buffer& non_finite) {
    const std::size_t paths = view.band.paths();
    graph::Pass pass = graph.add_pass("accumulate");
    gpu::Defines defines = view.scene.defines();
    pass.read(sample.gbuffer.surfaces, Access::storage_read);
    if (sample.direct) {
        pass.read(sample.direct->light, Access::storage_read);
        pass.read(sample.direct->occluded, Access::storage_read);
        defines.set("HALFLIGHT_LIGHT_SAMPLES");
    }
    if (sample.paths) {
        pass.read(sample.paths->states, Access::storage_read);
        defines.set("HALFLIGHT_PATHS");
    }
    const bool pending = sample.continuation && sample.continuation->occluded;
    if (pending) {
        pass.read(sample.continuation->occluded, Access::storage_read);
        defines.set("HALFLIGHT_PENDING");
    }

    std::vector<Sums> sums;
    Accumulated out;
    const auto keep = [&](const char* name, std::size_t doubles, GLuint binding) {
        sums.emplace_back(graph, pass, name, paths * doubles * sizeof(double), binding);
        return sums.back().pair.now;
    };
    out.emission = keep("emission sums", 4, 5);
    if (sample.direct || sample.paths) out.direct = keep("direct sums", 6, 7);
    if (pending) out.indirect = keep("indirect sums", 6, 9);
    if (options.squares) {
        out.squares = keep("square sums", 3, 11);
        defines.set("HALFLIGHT_SQUARES");
    }
    if (options.features) {
        out.features = keep("feature sums", 6, 14);
        defines.set("HALFLIGHT_FEATURES");
    }
    out.non_finite = pass.write(graph.import_buffer("non-finite counts", non_finite), Access::storage_read_write);

    pass.execute([=](graph::Resources& r) {
        r.buffer(sample.gbuffer.surfaces).bind_storage(0);
        if (sample.direct) {
            r.buffer(sample.direct->light).bind_storage(1);
            r.buffer(sample.direct->occluded).bind_storage(2);
        }
        if (sample.paths) r.buffer(sample.paths->states).bind_storage(3);
        if (pending) r.buffer(sample.continuation->occluded).bind_storage(4);
        for (const Sums& s : sums) s.bind(r);
        r.buffer(out.non_finite).bind_storage(13);
        r.programs().compute("shaders/accumulate.comp", defines).dispatch(view.band.paths() / 64);
    });
    return out;
}

}  // namespace halflight
