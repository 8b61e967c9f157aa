// Serves ray batches of scenes that are loaded in pages.
//
// Rays are traced through the pages that are in memory. A ray that meets a missing page goes on with what is there, and
// is traced again once the page is there. Pages for which most rays wait are loaded first. Each ray has an order of the
// pages that it meets, and needs a page only until it has searched it. So rays end whatever the size of the pool
// (shaders/trace_paged.comp). Pages are read while the device traces rays whose pages are there.
//
// Pages can also be loaded before a batch is traced (PageSchedule): those that the batch used last time, or those that
// tiles of rays can meet.
//
// Hits are equal, bit for bit, whatever is in memory (shaders/lib/traverse.glsl).
#pragma once

#include <cstdint>
#include <map>
#include <optional>

#include "engine/paging/page_pool.h"
#include "engine/paging/page_queries.h"
#include "engine/paging/page_schedule.h"
#include "engine/rays/batch_server.h"

namespace halflight::paging {

class PageServer final : public rays::BatchServer {
  public:
    /// Bytes per ray of the largest batch, for rays that wait.
    static constexpr std::size_t kRayBytes = 2 * sizeof(std::uint32_t) + sizeof(uvec2);

    /// Serves the scene of a pool, which outlives the server.
    explicit PageServer(PagePool& pool, PageSchedule schedule = kDefaultPageSchedule,
                        PageQueries::Method method = PageQueries::Method::compute);

    /// Adds the pass that traces a batch. `scene` is that of the pool.
    graph::BufferHandle add(graph::Graph& graph, const rays::TraceScene& scene, const rays::RayBatch& batch,
                            graph::BufferHandle results, bool any_hit) override;
    void follow(const rays::ServedScene&) override;
    void invalidate() override;
    void reset_statistics() override;
    std::size_t state_bytes(const rays::RayBatch& batch) const override;

    PagingStatistics statistics() const;

  private:
    class Run;
    /// State of similar batches.
    struct Memory {
        std::uint32_t number = 0;         // number for PageUses
        bool waited = true;               // many rays of the last run waited for pages
        std::optional<gpu::Buffer> ends;  // per ray: t at which the ray of the last run ended; for camera rays
    };
    bool keeps_ends(const rays::RayBatch& batch) const;

    PagePool& pool_;
    PageSchedule schedule_;
    PageQueries::Method method_;
    std::uint32_t serial_;  // TraceScene::serial() of the pose
    std::optional<PageQueries> queries_;
    std::map<rays::BatchKey, Memory> memories_;
    gpu::Buffer wanted_;   // per root: number of rays that wait for it
    gpu::Buffer touched_;  // per slot: not 0 if rays have met its triangles
    PagingStatistics sums_;
};

}  // namespace halflight::paging
