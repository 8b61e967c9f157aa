// The whole frame, top to bottom.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "passes/accumulate.h"
#include "passes/gbuffer.h"

namespace halflight {

/// What was asked for.
struct FrameOptions {
    int bounces = 8;             // >= 0
    bool want_squares = false;   // for the variance
    bool want_features = false;  // albedo and normal
};

/// Whether a pass has anything to contribute, and the fact that says so where it has not.
struct PassNeed {
    const char* pass;
    const char* left_out = nullptr;  // null: it is needed
};
/// Of shadow, diffuse, glossy and continuation. Pure; what add_frame decides by.
std::array<PassNeed, 4> needed_passes(const SceneNeeds& needs, int bounces);

struct Frame {
    GBuffer gbuffer;
    Accumulated sums;
    std::vector<std::string> left_out;  // "pass: the fact that makes it contribute nothing"
};

/// Adds every pass that scene and options need for one sample of one band, and nothing else. Marks the sums as outputs.
Frame add_frame(graph::Graph& graph, const SceneView& view, const FrameOptions& options, gpu::Buffer& bad_values);

}  // namespace halflight
