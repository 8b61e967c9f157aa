// Sums over samples in double, separately for each component.
#pragma once

#include <optional>

#include "passes/picture/bad_values.h"
#include "passes/steps/sums.h"
#include "shaders/shared/path_state.h"

namespace halflight {

struct AccumulateOptions {
    bool squares = false;
    bool features = false;
    bool halves = false;
    std::optional<float> clamp{};  // highest luminance of a sample's indirect light, > 0, +inf allowed
    std::uint32_t sums = 0;        // index of the sums, if bands have sums of their own
};

/// Adds one sample to the sums, which are carried in the graph's History; sample 0 of a frame starts them anew.
/// `bad_values` are kBadValueCounts uints that outlive the graph; counts are added to them.
Accumulated add_accumulate(graph::Graph& graph, const SceneView& view, const SampleInputs& sample,
                           const AccumulateOptions& options, gpu::Buffer& bad_values);

}  // namespace halflight
