#include "passes/frame.h"

#include "passes/continuation.h"
#include "passes/diffuse.h"
#include "passes/glossy.h"
#include "passes/shadow.h"

namespace halflight {

Frame add_frame(graph::Graph& graph, const SceneView& view, const FrameOptions& options, gpu::Buffer& non_finite) {
    const SceneNeeds& needs = view.scene.needs();
    Frame frame;
    const auto leave_out = [&](const char* pass, const char* reason) {
        frame.left_out.push_back(std::string(pass) + ": " + reason);
    };

    frame.gbuffer = add_gbuffer(graph, view);
    SampleInputs sample;
    sample.gbuffer = frame.gbuffer;

    const bool reflects = needs.diffuse || needs.glossy;
    const char* no_light_transport = !reflects              ? "no material reflects light"
                                     : options.bounces == 0 ? "no bounces were asked for"
                                                            : nullptr;
    if (no_light_transport) {
        for (const char* pass : {"shadow", "diffuse", "glossy", "continuation"}) leave_out(pass, no_light_transport);
    } else {
        if (needs.lights()) {
            sample.direct = add_shadow(graph, view, frame.gbuffer);
        } else {
            leave_out("shadow", "no light can be sampled");
        }

        PathBuffers paths = create_path_buffers(graph, view);
        std::vector<PathList> batches;
        if (needs.diffuse) {
            batches.push_back(add_diffuse(graph, view, frame.gbuffer, paths));
        } else {
            leave_out("diffuse", "no material has a diffuse component");
        }
        if (needs.glossy) {
            batches.push_back(add_glossy(graph, view, frame.gbuffer, paths));
        } else {
            leave_out("glossy", "no material has a specular, coat or transmission component");
        }
        sample.continuation = add_continuation(graph, view, batches, options.bounces, paths);
        sample.paths = paths;
    }

    frame.sums = add_accumulate(graph, view, sample, {options.want_squares, options.want_features}, non_finite);
    for (const graph::BufferHandle& sums : {frame.sums.emission, frame.sums.direct, frame.sums.indirect,
                                            frame.sums.squares, frame.sums.features, frame.sums.non_finite}) {
        if (sums) graph.output(sums);
    }
    return frame;
}

}  // namespace halflight
