// The wavefront beyond the first bounce: one kernel per vertex, one batch of shadow rays, one of closest-hit rays.
#pragma once

#include <vector>

#include "passes/light/scatter.h"

namespace halflight {

/// What later bounces add to a path lies in its PathState; the answer to its last shadow ray lies here.
struct Continuation {
    graph::BufferHandle occluded;      // uint by path: valid where the state's `pending` is; none without light samples
    graph::BufferHandle sun_occluded;  // likewise of the sun, where it is apart
    bool indirect = true;              // there are bounces later than the first
};

struct ContinuationOptions {
    int bounces = 8;            // reflections in all, >= 1: the first surface's is one
    bool light_samples = true;  // next-event estimation at every vertex
};

/// Follows the paths of `batches`, one at least, from their first hit on, with Russian roulette from depth 3 on.
/// Updates `paths`. Where they have `points` (bounces > 1), what leaves their second vertices diffusely lies there and
/// not in their states; where they have `cells`, too, paths end at those that know it.
Continuation add_continuation(graph::Graph& graph, const SceneView& view, const std::vector<PathList>& batches,
                              const ContinuationOptions& options, PathBuffers& paths);

}  // namespace halflight
