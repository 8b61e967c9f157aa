// The wavefront beyond the first bounce. Each vertex takes a resolve pass, a shading pass, a batch of shadow rays and a
// batch of closest-hit rays.
#pragma once

#include <vector>

#include "passes/steps/light_answers.h"
#include "passes/steps/paths.h"

namespace halflight {

struct ContinuationOptions {
    int bounces = 8;            // reflections in total, >= 1, that of the first surface included
    bool light_samples = true;  // whether to use next-event estimation at every vertex
};

/// Continues the paths of `batches`, at least one, from their first hit, with Russian roulette from depth 3 on. Updates
/// `paths`. If these have `points` (bounces > 1), light that leaves the second vertices diffusely is stored there
/// and not in the states. If they have `cells` as well, paths end at cells that know this light.
Continuation add_continuation(graph::Graph& graph, const SceneView& view, const std::vector<PathList>& batches,
                              const ContinuationOptions& options, PathBuffers& paths);

}  // namespace halflight
