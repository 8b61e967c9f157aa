#include "tools/measure/bench/graph_run.h"

#include <algorithm>

#include "engine/core/error.h"
#include "shaders/shared/path_state.h"
#include "shaders/shared/reuse_groups.h"

namespace halflight::bench {

std::size_t widest_record_bytes(const SceneBuffers& scene) {
    constexpr std::size_t sums = 6 * sizeof(double);  // bytes: RGB radiance of two lobes
    return std::max({scene.surface_record_bytes(), sizeof(shared::PathState), sums});
}

graph::BufferHandle named(const graph::Graph& graph, std::string_view name) {
    const auto& nodes = graph.resources();
    const auto found = std::ranges::find(nodes.rbegin(), nodes.rend(), name, &graph::ResourceNode::name);
    if (found == nodes.rend()) throw Error("bench", "the passes have no \"{}\"", name);
    return {static_cast<std::uint32_t>(nodes.rend() - found - 1), found->current(), graph.serial()};
}

AddTrace add_plain(const Bench& bench) {
    return [&trace = bench.trace](graph::Graph& graph, const rays::RayBatch& batch, graph::BufferHandle results,
                                  bool any) {
        return any ? rays::any_hit(graph, trace, batch, results) : rays::closest_hit(graph, trace, batch, results);
    };
}

AddTrace add_served(const Bench& bench, rays::BatchServer& server) {
    return [&trace = bench.trace, &server](auto& graph, const auto& batch, auto results, bool any) {
        return server.add(graph, trace, batch, results, any);
    };
}

GraphRun::GraphRun(gpu::ProgramCache& programs, const RaySet& set, const AddTrace& add)
    : rays_(gpu::Buffer::from("rays", set.rays)),
      list_(gpu::Buffer::from("list", set.listed ? set.order : std::vector<std::uint32_t>{})),
      header_("list header", sizeof(shared::ListHeader)),
      results_("results", set.rays.size() * answer_bytes(set)),
      executor_(programs) {
    const auto count = static_cast<std::uint32_t>(set.order.size());
    const shared::ListHeader head{(count + 63) / 64, 1, 1, count};
    header_.write(0, sizeof(head), &head);
    graph::Graph graph;
    rays::RayBatch batch;
    batch.kind = set.ray_kind;
    batch.capacity = static_cast<std::uint32_t>(set.rays.size());
    batch.rays = graph.import_buffer("rays", rays_);
    if (set.ray_kind == rays::RayKind::connection && !set.listed) batch.rays_of_path = shared::kMostGroupSize;
    if (set.listed) {
        batch.list = graph.import_buffer("list", list_);
        batch.list_header = graph.import_buffer("list header", header_);
    }
    graph.output(add(graph, batch, graph.import_buffer("results", results_), set.any_hit));
    compiled_ = graph::compile(graph);
}

Answers GraphRun::answers(const RaySet& set) const {
    return set.any_hit ? Answers{{}, results_.read<std::uint32_t>()} : Answers{results_.read<shared::Hit>(), {}};
}

Answers empty_answers(const RaySet& set) {
    Answers answers;
    if (set.any_hit) {
        answers.occluded.resize(set.rays.size());
    } else {
        answers.hits.resize(set.rays.size());
    }
    return answers;
}

std::size_t answer_bytes(const RaySet& set) {
    return set.any_hit ? sizeof(std::uint32_t) : sizeof(shared::Hit);
}

}  // namespace halflight::bench
