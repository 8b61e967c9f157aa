// Traces a ray set by the engine's render graph.
#pragma once

#include <functional>
#include <string_view>

#include "engine/device/scene_buffers.h"
#include "engine/graph/compile.h"
#include "engine/graph/execute.h"
#include "engine/rays/batch_server.h"
#include "tools/measure/bench/method.h"

namespace halflight::bench {

/// Adds the passes that answer a batch; returns the answers.
using AddTrace =
    std::function<graph::BufferHandle(graph::Graph&, const rays::RayBatch&, graph::BufferHandle results, bool any_hit)>;

/// Returns the last version of the graph's resource of that name, which may be internal to a pass. Throws Error if
/// there is none.
graph::BufferHandle named(const graph::Graph& graph, std::string_view name);

/// Returns the bytes of the widest record that a frame keeps per path.
std::size_t widest_record_bytes(const SceneBuffers& scene);

/// Returns the passes that trace without culling.
AddTrace add_plain(const Bench& bench);
/// Returns the passes of a server, which must outlive the graph's runs.
AddTrace add_served(const Bench& bench, rays::BatchServer& server);

class GraphRun {
  public:
    GraphRun(gpu::ProgramCache& programs, const RaySet& set, const AddTrace& add);

    void run() { executor_.run(compiled_); }
    /// Returns the answers by path, as Hits or uints.
    const gpu::Buffer& results() const { return results_; }
    Answers answers(const RaySet& set) const;
    graph::Executor& executor() { return executor_; }

  private:
    gpu::Buffer rays_, list_, header_, results_;
    graph::CompiledGraph compiled_;
    graph::Executor executor_;
};

/// Returns answers with room for all paths.
Answers empty_answers(const RaySet& set);
std::size_t answer_bytes(const RaySet& set);

}  // namespace halflight::bench
