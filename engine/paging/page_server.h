// Serves ray batches of scenes that are loaded in pages, by demand.
//
// Rays are traced through the pages that are in memory. A ray that meets a missing page goes on with what is there, and
// is traced again once the page is there. If the pages that rays wait for do not fit into the pool together, rounds of
// that kind may never end. A sweep then goes through all pages in portions that fit; rays wait only for pages of the
// portion.
//
// Hits are equal, bit for bit, whatever is in memory (shaders/lib/traverse.glsl).
#pragma once

#include <cstdint>

#include "engine/paging/page_pool.h"
#include "engine/rays/batch_server.h"

namespace halflight::paging {

class PageServer final : public rays::BatchServer {
  public:
    /// Number of rounds after which a batch sweeps.
    static constexpr int kMostRounds = 64;

    /// Serves the scene of a pool, which outlives the server.
    explicit PageServer(PagePool& pool);

    /// Adds the pass that traces a batch. `scene` is that of the pool, which has no alpha tests.
    graph::BufferHandle add(graph::Graph& graph, const rays::TraceScene& scene, const rays::RayBatch& batch,
                            graph::BufferHandle results, bool any_hit) override;
    void reset_statistics() override;

    PagingStatistics statistics() const;

  private:
    class Run;
    PagePool& pool_;
    gpu::Buffer wanted_;  // per root: number of rays that wait for it
    gpu::Buffer requests_;
    PagingStatistics sums_;
};

}  // namespace halflight::paging
