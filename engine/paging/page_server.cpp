#include "engine/paging/page_server.h"

#include <epoxy/gl.h>
#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <numeric>
#include <vector>

#include "engine/graph/execute.h"
#include "shaders/shared/rays.h"

namespace halflight::paging {
namespace {

using graph::Access;

/// Lists of waiting rays: two for the rounds, one for the rays of a sweep.
struct Lists {
    graph::BufferHandle paths[3];
    graph::BufferHandle headers[3];
};

}  // namespace

/// One batch in one run of a graph.
class PageServer::Run {
  public:
    Run(PageServer& server, graph::Resources& resources, const rays::RayBatch& batch, graph::BufferHandle results,
        const Lists& lists, bool any_hit)
        : server_(server),
          pool_(server.pool_),
          resources_(resources),
          batch_(batch),
          results_(results),
          lists_(lists),
          any_hit_(any_hit),
          roots_(pool_.first_root(pool_.pages())) {}

    void run() {
        ++server_.sums_.batches;
        trace({}, 0, {0, roots_});
        std::uint64_t evicted = pool_.traffic().evicted;
        std::uint32_t from = 0;
        for (int round = 1; waiting(from) > 0; ++round) {
            // Pages that leave while rays wait for others may be those that rays need next.
            const bool thrashes = pool_.traffic().evicted - evicted > 2 * std::uint64_t{pool_.slots()};
            if (round > kMostRounds || thrashes) {
                sweep(from);
                return;
            }
            load();
            trace(from, 1 - from, {0, roots_});
            from = 1 - from;
        }
    }

  private:
    struct Source {
        bool again = false;
        std::uint32_t list = 0;
        Source() = default;
        Source(std::uint32_t waiting) : again(true), list(waiting) {}
    };

    /// Traces the batch, or one of the lists, and puts the rays that wait into list `to`.
    void trace(Source from, std::uint32_t to, const uvec2& awaited) {
        ++server_.sums_.rounds;
        gpu::Defines defines = pool_.scene().defines();
        if (any_hit_) defines.set("HALFLIGHT_ANY_HIT");
        if (from.again || batch_.list) defines.set("HALFLIGHT_LIST");
        const gpu::Program& program = resources_.programs().compute("shaders/trace_paged.comp", defines);
        rays::RayBatch batch = batch_;
        if (from.again) {
            batch.list = lists_.paths[from.list];
            batch.list_header = lists_.headers[from.list];
            batch.rays_of_path = 1;  // lists hold rays
        }
        const shared::ListHeader empty{0, 1, 1, 0};
        resources_.buffer(lists_.headers[to]).write(std::span(&empty, 1));
        server_.requests_.fill(0);
        server_.wanted_.fill(0);
        rays::bind_batch(resources_, program, pool_.scene(), batch);
        program.bind_storage(any_hit_ ? "Occluded" : "Hits", resources_.buffer(results_));
        program.bind_storage("Waiting", resources_.buffer(lists_.paths[to]));
        program.bind_storage("WaitingHeader", resources_.buffer(lists_.headers[to]));
        program.bind_storage("Requests", server_.requests_);
        program.bind_storage("Wanted", server_.wanted_);
        program.set("awaited_roots", awaited);
        program.set("again", from.again);
        if (batch.list)
            program.dispatch_indirect(resources_.buffer(batch.list_header));
        else
            program.dispatch((batch.capacity + 63) / 64);
        glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_COMMAND_BARRIER_BIT | GL_BUFFER_UPDATE_BARRIER_BIT |
                        GL_TEXTURE_FETCH_BARRIER_BIT);
    }

    std::uint32_t waiting(std::uint32_t list) {
        const std::uint32_t count =
            resources_.buffer(lists_.headers[list]).read<shared::ListHeader>(0, 1).front().count;
        server_.sums_.again += count;
        return count;
    }

    /// Loads the requested pages, or those that most rays wait for where they do not all fit.
    void load() {
        const std::uint32_t count = server_.requests_.read<std::uint32_t>(0, 1).front();
        const std::vector<std::uint32_t> roots = server_.requests_.read<std::uint32_t>(1, count);
        std::vector<std::uint32_t> pages;
        for (const std::uint32_t root : roots) pages.push_back(pool_.page_of(root));
        std::ranges::sort(pages);
        pages.erase(std::ranges::unique(pages).begin(), pages.end());
        if (pages.size() > pool_.slots()) {
            const std::vector<std::uint32_t> wanted = server_.wanted_.read<std::uint32_t>();
            const auto rays = [&](std::uint32_t page) {
                return std::accumulate(wanted.begin() + pool_.first_root(page),
                                       wanted.begin() + pool_.first_root(page + 1), std::uint64_t{0});
            };
            std::ranges::stable_sort(pages, std::ranges::greater(), rays);
            pages.resize(pool_.slots());
        }
        pool_.load(pages);
    }

    /// Completes the rays of a list, page by page in portions that fit into the pool.
    void sweep(std::uint32_t from) {
        ++server_.sums_.sweeps;
        const std::uint32_t kept = 2;
        gpu::Buffer& paths = resources_.buffer(lists_.paths[kept]);
        glCopyNamedBufferSubData(resources_.buffer(lists_.paths[from]).id(), paths.id(), 0, 0,
                                 static_cast<GLsizeiptr>(batch_.capacity * sizeof(std::uint32_t)));
        glCopyNamedBufferSubData(resources_.buffer(lists_.headers[from]).id(),
                                 resources_.buffer(lists_.headers[kept]).id(), 0, 0, sizeof(shared::ListHeader));
        for (std::uint32_t page = 0; page < pool_.pages(); page += pool_.lasting_slots()) {
            const std::uint32_t end = std::min(page + pool_.lasting_slots(), pool_.pages());
            const uvec2 awaited(pool_.first_root(page), pool_.first_root(end));
            ++server_.sums_.windows;
            trace(kept, 0, awaited);
            for (std::uint32_t list = 0; waiting(list) > 0; list = 1 - list) {
                load();
                trace(list, 1 - list, awaited);
            }
        }
    }

    PageServer& server_;
    PagePool& pool_;
    graph::Resources& resources_;
    const rays::RayBatch& batch_;
    const graph::BufferHandle results_;
    const Lists& lists_;
    const bool any_hit_;
    const std::uint32_t roots_;
};

PageServer::PageServer(PagePool& pool)
    : pool_(pool),
      wanted_("rays that wait for pages", pool.first_root(pool.pages()) * sizeof(std::uint32_t)),
      requests_("requested pages", (1 + std::size_t{pool.first_root(pool.pages())}) * sizeof(std::uint32_t)) {}

graph::BufferHandle PageServer::add(graph::Graph& graph, const rays::TraceScene& scene, const rays::RayBatch& batch,
                                    graph::BufferHandle results, bool any_hit) {
    rays::check_groups((batch.capacity + 63) / 64, batch.capacity);
    graph::Pass pass =
        graph.add_pass(fmt::format("{} rays: {}, paged", name(batch.kind), any_hit ? "any hit" : "closest hit"));
    rays::read_batch(pass, scene, batch);
    results = rays::write_results(pass, batch, results);
    Lists lists;
    for (std::size_t i = 0; i < 3; ++i) {
        lists.paths[i] = pass.write(graph.create_buffer("waiting rays", {batch.capacity * sizeof(std::uint32_t)}),
                                    Access::storage_write);
        lists.headers[i] = pass.write(graph.create_buffer("header of waiting rays", {sizeof(shared::ListHeader)}),
                                      Access::storage_write);
    }
    pass.execute([=, this](graph::Resources& r) { Run(*this, r, batch, results, lists, any_hit).run(); });
    return results;
}

void PageServer::reset_statistics() {
    sums_ = {};
    pool_.reset_traffic();
}

PagingStatistics PageServer::statistics() const {
    PagingStatistics s = sums_;
    s.traffic = pool_.traffic();
    s.slots = pool_.slots();
    s.pages = pool_.pages();
    return s;
}

}  // namespace halflight::paging
