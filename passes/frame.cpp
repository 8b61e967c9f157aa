#include "passes/frame.h"

#include "passes/continuation.h"
#include "passes/diffuse.h"
#include "passes/glossy.h"
#include "passes/shadow.h"

namespace halflight {

std::array<PassNeed, 4> needed_passes(const SceneNeeds& needs, int bounces) {
    const char* no_transport = !(needs.diffuse || needs.glossy) ? "no material reflects light"
                               : bounces == 0                   ? "no bounces were asked for"
                                                                : nullptr;
    const auto unless = [&](bool needed, const char* reason) {
        return no_transport ? no_transport : needed ? nullptr : reason;
    };
    return {{{"shadow", unless(needs.lights(), "no light can be sampled")},
             {"diffuse", unless(needs.diffuse, "no material has a diffuse component")},
             {"glossy", unless(needs.glossy, "no material has a specular, coat or transmission component")},
             {"continuation", no_transport}}};
}

Frame add_frame(graph::Graph& graph, const SceneView& view, const FrameOptions& options, gpu::Buffer& bad_values) {
    const auto [shadow, diffuse, glossy, continuation] = needed_passes(view.scene.needs(), options.bounces);
    Frame frame;
    for (const PassNeed& need : {shadow, diffuse, glossy, continuation})
        if (need.left_out) frame.left_out.push_back(std::string(need.pass) + ": " + need.left_out);

    frame.gbuffer = add_gbuffer(graph, view);
    SampleInputs sample;
    sample.gbuffer = frame.gbuffer;
    if (!shadow.left_out) sample.direct = add_shadow(graph, view, frame.gbuffer);
    if (!continuation.left_out) {
        PathBuffers paths = create_path_buffers(graph, view);
        std::vector<PathList> batches;
        if (!diffuse.left_out) batches.push_back(add_diffuse(graph, view, frame.gbuffer, paths));
        if (!glossy.left_out) batches.push_back(add_glossy(graph, view, frame.gbuffer, paths));
        sample.continuation = add_continuation(graph, view, batches, options.bounces, paths);
        sample.paths = paths;
    }

    frame.sums = add_accumulate(graph, view, sample, {options.want_squares, options.want_features}, bad_values);
    for (const graph::BufferHandle& sums : {frame.sums.emission, frame.sums.direct, frame.sums.indirect,
                                            frame.sums.squares, frame.sums.features, frame.sums.bad_values}) {
        if (sums) graph.output(sums);
    }
    return frame;
}

}  // namespace halflight
