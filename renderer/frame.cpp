#include "renderer/frame.h"

#include "passes/light/continuation.h"
#include "passes/light/first_scatter.h"
#include "passes/light/radiance_cache.h"
#include "passes/light/reuse.h"
#include "passes/light/shadow.h"
#include "passes/light/specular_chain.h"
#include "passes/picture/shadow_catcher.h"
#include "passes/steps/lamps.h"

namespace halflight {

Frame add_frame(graph::Graph& graph, const SceneView& view, const FrameOptions& options, const FrameInputs& inputs) {
    const FrameNeeds needs = frame_needs(view.scene.needs(), options);
    Frame frame;
    frame.gbuffer =
        add_gbuffer(graph, view, {.rays = bool(needs.camera_rays), .hits = bool(needs.camera_hits)}, options.primary);
    SampleInputs sample;
    sample.gbuffer = frame.gbuffer;
    if (needs.seen)
        sample.seen = add_seen(graph, view, inputs.seen_constants, options.primary, bool(needs.shown_lamps));
    else if (needs.shown_lamps)
        sample.lamps = add_shown_lamps(graph, view, frame.gbuffer);
    if (needs.shadow) sample.direct = add_shadow(graph, view, frame.gbuffer);
    if (needs.continuation) {
        PathBuffers paths = create_path_buffers(graph, view);
        if (needs.reuse) paths.points = create_reuse_points(graph, view);
        if (view.light_groups > 0)
            paths.group_light = graph.create_buffer(
                "light of groups", {view.band.paths() * group_light_bytes(view.light_groups, bool(needs.reuse))});
        if (needs.radiance_cache) use_radiance_cache(graph, view, *inputs.cache, paths);
        std::vector<PathList> batches;
        if (needs.diffuse) batches.push_back(add_diffuse(graph, view, frame.gbuffer, paths));
        if (needs.glossy) batches.push_back(add_glossy(graph, view, frame.gbuffer, paths));
        sample.continuation = add_continuation(
            graph, view, batches, {.bounces = options.bounces, .light_samples = bool(needs.later_light)}, paths);
        if (needs.reuse)
            sample.received = add_reuse(graph, view, frame.gbuffer, paths, *sample.continuation,
                                        static_cast<std::uint32_t>(options.group_size));
        if (needs.radiance_cache) add_radiance_cache(graph, view, *inputs.cache, *sample.continuation, paths);
        sample.paths = paths;
    }

    if (needs.chains)
        sample.chains = add_specular_chains(graph, view, frame.gbuffer, {.bounces = options.bounces}).chains;

    AccumulateOptions wanted{bool(needs.squares), bool(needs.features), bool(needs.halves), std::nullopt, inputs.sums};
    if (needs.clamp) wanted.clamp = options.clamp > 0 ? options.clamp : kInfinity;
    // All rays precede the sums: work that ends at a batch leaves the sums of whole samples (interruption.h).
    CatcherOcclusion by_catchers;
    if (view.scene.needs().catchers) by_catchers = add_catcher_occlusion(graph, view, sample);
    frame.sums = add_accumulate(graph, view, sample, wanted, inputs.bad_values);
    if (view.scene.needs().catchers) add_shadow_catchers(graph, view, sample, by_catchers, inputs.sums, frame.sums);
    for (const graph::BufferHandle& sums :
         {frame.sums.emission, frame.sums.direct, frame.sums.indirect, frame.sums.squares, frame.sums.groups,
          frame.sums.catchers, frame.sums.features, frame.sums.halves, frame.sums.bad_values}) {
        if (sums) graph.output(sums);
    }
    if (options.want_hits) graph.output(frame.gbuffer.hits);
    return frame;
}

}  // namespace halflight
