// Shadow catchers: the light that falls on them, with and without the other objects.
#pragma once

#include "passes/steps/sums.h"

namespace halflight {


/// Answers like those of any_hit(): whether catchers occlude the occluded light samples, too. A handle is empty if
/// there are no such rays.
struct CatcherOcclusion {
    graph::BufferHandle lights, sun;
};
/// Traces the occluded shadow rays of catchers once more, through all other surfaces.
CatcherOcclusion add_catcher_occlusion(graph::Graph& graph, const SceneView& view, const SampleInputs& sample);

/// Adds the light samples of a sample to the sums of shadow catchers, Accumulated::catchers, and counts bad values in
/// `sums`, which add_accumulate() has returned. index: AccumulateOptions::sums. An occluded sample counts for the light
/// without the other objects if no catcher occludes it.
void add_shadow_catchers(graph::Graph& graph, const SceneView& view, const SampleInputs& sample,
                         const CatcherOcclusion& occlusion, std::uint32_t index, Accumulated& sums);

}  // namespace halflight
