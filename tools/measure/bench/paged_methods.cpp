#include "tools/measure/bench/paged_methods.h"

#include <algorithm>

#include "engine/core/error.h"
#include "engine/paging/page_server.h"
#include "tools/measure/bench/graph_run.h"

namespace halflight::bench {
namespace {

/// A ray set with a pool and a server of its own.
class PagedRun {
  public:
    PagedRun(const Bench& bench, const RaySet& set, std::size_t pool_bytes)
        : pool_(*bench.pages, pool_bytes),
          server_(pool_, bench.page_schedule),
          run_(bench.programs, set,
               [this](graph::Graph& graph, const rays::RayBatch& batch, graph::BufferHandle results, bool any) {
                   return server_.add(graph, pool_.scene(), batch, results, any);
               }) {}

    void run() { run_.run(); }
    void forget() {
        pool_.clear();
        server_.invalidate();
    }
    Answers answers(const RaySet& set) const { return run_.answers(set); }
    /// Returns the statistics of one more run.
    paging::PagingStatistics look() {
        server_.reset_statistics();
        run();
        return server_.statistics();
    }

  private:
    paging::PagePool pool_;
    paging::PageServer server_;
    GraphRun run_;
};

std::vector<Figure> figures_of(const paging::PagingStatistics& s) {
    return {{"slots", static_cast<double>(s.slots)},
            {"loaded", static_cast<double>(s.traffic.loaded)},
            {"MB", 1e-6 * static_cast<double>(s.traffic.bytes)},
            {"waits ms", 1e3 * s.traffic.seconds},
            {"rounds", static_cast<double>(s.rounds)},
            {"again", static_cast<double>(s.again)},
            {"used", static_cast<double>(s.prefetched_used)},
            {"unused", static_cast<double>(s.prefetched_unused)},
            {"query ms", 1e3 * s.query_seconds}};
}

/// `share` of the pages that the set needs fit into the pool; 0: Bench::pool_bytes.
Method make(const char* name, const Bench& bench, double share, bool cold) {
    if (!bench.pages) throw Error(name, "needs --pages");
    if (bench.pages->index().triangles != bench.tables.triangles.size())
        throw Error(name, "the page file was made of another scene");
    // In small scenes, hits of triangles that are split between leaves may differ by their rounding.
    const bool exact = bench.tables.triangles.size() > rays::kMostInPart;
    return {name, exact, [bench, share, cold](const RaySet& set) -> Prepared {
                std::size_t bytes = bench.pool_bytes;
                if (share > 0) {
                    const std::uint64_t needed = PagedRun(bench, set, ~std::size_t{0}).look().traffic.loaded;
                    const auto slots = static_cast<std::size_t>(share * static_cast<double>(needed));
                    bytes = std::max<std::size_t>(slots, 1) * paging::PagePool::slot_bytes(bench.pages->index());
                }
                const auto run = std::make_shared<PagedRun>(bench, set, bytes);
                Prepared prepared{.run = [run] { run->run(); },
                                  .answers = [run, &set] { return run->answers(set); },
                                  .figures =
                                      [run, cold] {
                                          if (cold) run->forget();
                                          return figures_of(run->look());
                                      }};
                if (cold) prepared.before = [run] { run->forget(); };
                return prepared;
            }};
}

}  // namespace

Method paged_method(const Bench& bench) {
    return make("paged", bench, 0, false);
}
Method paged_cold_method(const Bench& bench) {
    return make("paged-cold", bench, 0, true);
}
Method paged_half_method(const Bench& bench) {
    return make("paged-half", bench, 0.5, false);
}
Method paged_quarter_method(const Bench& bench) {
    return make("paged-quarter", bench, 0.25, false);
}

}  // namespace halflight::bench
