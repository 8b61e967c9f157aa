#include "tools/bench/viewpoint.h"

#include <algorithm>

#include "engine/core/error.h"
#include "passes/frame_constants.h"
#include "shaders/shared/sobol.h"

namespace halflight::bench {

shared::Frame see(const TraceTables& tables, const Cameras& cameras, const Band& band, const SampleNumber& number) {
    const std::uint32_t seed = shared::hash_combine(shared::hash_u32(number.seed), number.frame);
    const dvec3 eye = dvec3(cameras.now.camera_to_world[3]) - tables.origin;
    const dvec3 reach =
        glm::max(glm::abs(dvec3(tables.bounds.lower) - eye), glm::abs(dvec3(tables.bounds.upper) - eye));
    const vec2 jitter = shared::sample_2d(shared::make_sampler(~0u, ~0u, number.sample, seed), 0);
    return frame_constants(cameras.now, cameras.before, tables.origin, tables.bounds.empty() ? 1 : glm::length(reach),
                           {band, jitter, number.sample, seed});
}

graph::BufferHandle named(const graph::Graph& graph, std::string_view name) {
    const auto& nodes = graph.resources();
    const auto found = std::ranges::find(nodes.rbegin(), nodes.rend(), name, &graph::ResourceNode::name);
    if (found == nodes.rend()) throw Error("bench", "the passes have no \"{}\"", name);
    return {static_cast<std::uint32_t>(nodes.rend() - found - 1), found->current(), graph.serial()};
}

}  // namespace halflight::bench
