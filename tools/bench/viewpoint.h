// What the bench takes out of the renderer's hands: cameras, seeds, and what passes keep to themselves.
#pragma once

#include <string_view>

#include "engine/graph/graph.h"
#include "engine/scene/tables.h"
#include "passes/scene_view.h"
#include "shaders/shared/frame.h"

namespace halflight::bench {

struct Cameras {
    Camera now;
    Camera before;  // of the frame before
};

/// As of RenderSettings.
struct SampleNumber {
    std::uint32_t sample = 0;
    std::uint32_t frame = 0;
    std::uint32_t seed = 0;
};

/// Constants of the same sample as rendered by Renderer.
shared::Frame see(const TraceTables& tables, const Cameras& cameras, const Band& band, const SampleNumber& number);

/// The last version of the graph's resource of that name. Throws Error where there is none.
graph::BufferHandle named(const graph::Graph& graph, std::string_view name);

}  // namespace halflight::bench
