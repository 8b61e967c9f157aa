// Sums over samples, components kept apart, in double.
#pragma once

#include <optional>

#include "passes/continuation.h"
#include "passes/gbuffer.h"
#include "passes/shadow.h"

namespace halflight {

/// What one sample has to offer; what the frame left out is empty.
struct SampleInputs {
    GBuffer gbuffer;
    std::optional<DirectLightEstimate> direct;
    std::optional<PathBuffers> paths;
    std::optional<Continuation> continuation;
};

/// Sums over all samples so far, at the path index; divide by the number of samples.
/// Handles of what the frame left out are empty.
struct Accumulated {
    graph::BufferHandle emission;    // 4 doubles: rgb, coverage (1 for every sample that met a surface)
    graph::BufferHandle direct;      // 6 doubles: diffuse rgb, glossy rgb
    graph::BufferHandle indirect;    // 6 doubles: diffuse rgb, glossy rgb
    graph::BufferHandle squares;     // 3 doubles: squares of the samples' beauty, for its variance
    graph::BufferHandle non_finite;  // kCountedPasses uints: values that were NaN or infinite and taken as zero
};

/// The sums live in the graph's history: a run adds one sample, an invalidation starts anew. `non_finite`: kCountedPasses
/// uints that outlive the graph and are counted up.
Accumulated add_accumulate(graph::Graph& graph, const SceneView& view, const SampleInputs& sample, bool want_squares,
                           gpu::Buffer& non_finite);

}  // namespace halflight
