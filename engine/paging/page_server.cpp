#include "engine/paging/page_server.h"

#include <epoxy/gl.h>
#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <utility>
#include <vector>

#include "engine/core/interruption.h"
#include "engine/core/stopwatch.h"
#include "engine/graph/execute.h"
#include "shaders/shared/ray_structs.h"

namespace halflight::paging {
namespace {

using graph::Access;

/// Share of the demand that has to be there before rays are traced (again). The rest is read meanwhile.
constexpr double kShareToTrace = 0.5;

/// One work group in so many goes ahead of its batch.
constexpr std::uint32_t kScouts = 16;

struct Handles {
    graph::BufferHandle results;
    graph::BufferHandle waiting[2];  // paths of waiting rays, of the last and of the next dispatch
    graph::BufferHandle headers[2];
    graph::BufferHandle fronts;
    PageQueries::Targets queries;  // empty for batches that never query pages
};

/// A page and the number of rays that wait for it.
struct Wanted {
    std::uint32_t page = 0;
    std::uint64_t rays = 0;
};

void barrier() {
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_COMMAND_BARRIER_BIT | GL_BUFFER_UPDATE_BARRIER_BIT |
                    GL_TEXTURE_FETCH_BARRIER_BIT);
}

}  // namespace

/// One batch in one run of a graph.
class PageServer::Run {
  public:
    Run(PageServer& server, graph::Resources& resources, const rays::RayBatch& batch, const Handles& handles,
        bool any_hit)
        : server_(server),
          pool_(server.pool_),
          memory_(server.memories_[rays::key_of(batch)]),
          resources_(resources),
          batch_(batch),
          handles_(handles),
          any_hit_(any_hit),
          touches_(pool_.slots() < pool_.pages()) {}

    void run() {
        interruption_point();
        ++server_.sums_.batches;
        pool_.uses().begin(memory_.number);
        prefetch();
        // Rays of a batch that misses many pages would start again and again, so a few go ahead and fetch the pages.
        if (memory_.waited) serve(kScouts);
        memory_.waited = serve(1);
        end();
    }

  private:
    /// Traces one work group of rays in `stride`, until no ray waits. Returns whether many rays of the batch had to
    /// wait.
    bool serve(std::uint32_t stride) {
        trace(Source::batch(), 0, stride);
        const bool many = waiting(0) > batch_.capacity / kScouts;
        for (std::uint32_t list = 0; waiting_ > 0; list = 1 - list) {
            interruption_point();
            demand();
            trace(Source::waiting(list), 1 - list);
            waiting(1 - list);
        }
        return many;
    }

    /// Loads pages that the batch will need.
    void prefetch() {
        if (server_.schedule_ == PageSchedule::demand) return;
        std::vector<std::uint32_t> pages;
        if (handles_.queries && memory_.waited && (memory_.ends || batch_.kind != rays::RayKind::primary)) {
            const Stopwatch watch;
            pages = server_.queries_->pages(resources_, batch_, handles_.queries, any_hit_,
                                            memory_.ends ? &*memory_.ends : nullptr);
            ++server_.sums_.queries;
            server_.sums_.query_seconds += watch.seconds();
        } else {
            pages = pool_.uses().set();
        }
        // A pool that is smaller than the set would lose pages that rays need first.
        if (pages.size() > pool_.slots()) return;
        std::stable_partition(pages.begin(), pages.end(), [&](std::uint32_t page) { return pool_.resident(page); });
        std::vector<Wanted> wanted;
        for (const std::uint32_t page : pages) {
            wanted.push_back({page, 1});
            if (!pool_.resident(page)) prefetched_.push_back(page);
        }
        if (prefetched_.empty()) return;
        pool_.ask(pages);
        wait_for(wanted);
    }

    /// Rays that a dispatch traces.
    struct Source {
        bool again;          // false: all rays of the batch; true: those of a list that have been traced before
        std::uint32_t list;  // index into Handles::waiting
        static Source batch() { return {false, 0}; }
        static Source waiting(std::uint32_t list) { return {true, list}; }
    };
    /// Traces rays and puts those that wait into list `to`.
    void trace(Source from, std::uint32_t to, std::uint32_t stride = 1) {
        ++server_.sums_.rounds;
        gpu::Defines defines = rays::batch_defines(pool_.scene(), batch_);
        if (any_hit_) defines.set("HALFLIGHT_ANY_HIT");
        if (from.again || batch_.list) defines.set("HALFLIGHT_LIST");
        if (touches_) defines.set("HALFLIGHT_TOUCH");
        const gpu::Program& program = resources_.programs().compute("shaders/trace_paged.comp", defines);
        rays::RayBatch batch = batch_;
        if (from.again) {
            batch.list = handles_.waiting[from.list];
            batch.list_header = handles_.headers[from.list];
            batch.rays_of_path = 1;  // lists hold rays
        }
        const shared::ListHeader empty{0, 1, 1, 0};
        resources_.buffer(handles_.headers[to]).write(std::span(&empty, 1));
        server_.wanted_.clear();
        rays::bind_batch(resources_, program, pool_.scene(), batch);
        pool_.bind_rows(program);
        if (pool_.scene().alpha_tested()) program.set("rays_of_path", batch_.rays_of_path);
        program.bind_storage(any_hit_ ? "Occluded" : "Hits", resources_.buffer(handles_.results));
        program.bind_storage("Waiting", resources_.buffer(handles_.waiting[to]));
        program.bind_storage("WaitingHeader", resources_.buffer(handles_.headers[to]));
        program.bind_storage("Fronts", resources_.buffer(handles_.fronts));
        program.bind_storage("Wanted", server_.wanted_);
        program.bind_texture("shown_roots", pool_.shown_roots(), GL_R32UI);
        program.set("top", pool_.scene().top());
        program.set("again", from.again);
        program.set("group_stride", stride);
        if (touches_) {
            server_.touched_.clear();
            program.bind_storage("Touched", server_.touched_);
        }
        if (batch.list)
            program.dispatch_indirect(resources_.buffer(batch.list_header), (batch.capacity + 63) / 64);
        else
            program.dispatch((batch.capacity + 63) / 64);
        barrier();
    }

    /// Waits for the last dispatch, and returns the number of rays that wait for pages.
    std::uint32_t waiting(std::uint32_t list) {
        waiting_ = resources_.buffer(handles_.headers[list]).read<shared::ListHeader>(0, 1).front().count;
        server_.sums_.again += waiting_;
        if (touches_) pool_.touch(server_.touched_.read<std::uint32_t>());
        return waiting_;
    }

    /// Loads pages that rays wait for, those of most rays first.
    void demand() {
        const std::vector<std::uint32_t> rays = server_.wanted_.read<std::uint32_t>();
        std::vector<Wanted> pages;
        for (std::uint32_t root = 0; root < rays.size(); ++root) {
            if (rays[root] == 0) continue;
            const std::uint32_t page = pool_.page_of(root);
            if (pages.empty() || pages.back().page != page) pages.push_back({page, 0});
            pages.back().rays += rays[root];
        }
        std::ranges::stable_sort(pages, std::ranges::greater(), &Wanted::rays);
        pages.resize(std::min(pages.size(), std::size_t{pool_.slots()}));
        std::vector<std::uint32_t> asked;
        for (const Wanted& wanted : pages) asked.push_back(wanted.page);
        pool_.ask(asked);
        wait_for(pages);
    }

    /// Waits until pages for a share of the rays are there.
    void wait_for(const std::vector<Wanted>& pages) {
        std::uint64_t all = 0;
        for (const Wanted& wanted : pages) all += wanted.rays;
        for (bool more = pool_.take(false); more; more = pool_.take(true)) {
            std::uint64_t there = 0;
            for (const Wanted& wanted : pages) there += pool_.resident(wanted.page) ? wanted.rays : 0;
            if (static_cast<double>(there) >= kShareToTrace * static_cast<double>(all)) return;
        }
    }

    void end() {
        pool_.forget();
        if (touches_ && server_.schedule_ != PageSchedule::demand) pool_.uses().end();
        if (!touches_) prefetched_.clear();  // if no page leaves, uses are not recorded
        for (const std::uint32_t page : prefetched_)
            ++(pool_.uses().touched(page) ? server_.sums_.prefetched_used : server_.sums_.prefetched_unused);
        if (!server_.keeps_ends(batch_)) return;
        const std::size_t bytes = batch_.capacity * sizeof(float);
        if (!memory_.ends || memory_.ends->bytes() != bytes) memory_.ends.emplace("ends of camera rays", bytes);
        const gpu::Program& program = resources_.programs().compute("shaders/page_ends.comp");
        program.bind_storage("Hits", resources_.buffer(handles_.results));
        program.bind_storage("Ends", *memory_.ends);
        program.set("capacity", batch_.capacity);
        program.dispatch((batch_.capacity + 63) / 64);
        barrier();
    }

    PageServer& server_;
    PagePool& pool_;
    Memory& memory_;
    graph::Resources& resources_;
    const rays::RayBatch& batch_;
    const Handles& handles_;
    const bool any_hit_;
    const bool touches_;  // records which pages the batch uses; false if no page ever leaves
    std::uint32_t waiting_ = 0;
    std::vector<std::uint32_t> prefetched_;  // pages that were missing before the batch, and were asked for
};

PageServer::PageServer(PagePool& pool, PageSchedule schedule, PageQueries::Method method)
    : pool_(pool),
      schedule_(schedule),
      method_(method),
      serial_(pool.scene().serial()),
      wanted_("rays that wait for pages", pool.first_root(pool.pages()) * sizeof(std::uint32_t)),
      touched_("slots in use", pool.slots() * sizeof(std::uint32_t)) {
    if (schedule == PageSchedule::queries) queries_.emplace(pool.source().index(), method);
}

bool PageServer::keeps_ends(const rays::RayBatch& batch) const {
    return schedule_ == PageSchedule::queries && batch.kind == rays::RayKind::primary && !batch.list;
}

graph::BufferHandle PageServer::add(graph::Graph& graph, const rays::TraceScene& scene, const rays::RayBatch& batch,
                                    graph::BufferHandle results, bool any_hit) {
    rays::check_groups((batch.capacity + 63) / 64, batch.capacity);
    graph::Pass pass =
        graph.add_pass(fmt::format("{} rays: {}, paged", name(batch.kind), any_hit ? "any hit" : "closest hit"));
    rays::read_batch(pass, scene, batch);
    Handles handles;
    handles.results = rays::write_results(pass, batch, results);
    const auto scratch = [&](const char* name, std::size_t bytes) {
        return pass.write(graph.create_buffer(name, {bytes}), Access::storage_write);
    };
    for (std::size_t i = 0; i < 2; ++i) {
        handles.waiting[i] = scratch("waiting rays", batch.capacity * sizeof(std::uint32_t));  // kRayBytes counts it
        handles.headers[i] = scratch("header of waiting rays", sizeof(shared::ListHeader));
    }
    handles.fronts = scratch("fronts of waiting rays", batch.capacity * sizeof(uvec2));
    if (queries_ && PageQueries::serves(batch.kind))
        handles.queries = queries_->declare(graph, pass, batch, handles.results);
    memories_.try_emplace(rays::key_of(batch), Memory{static_cast<std::uint32_t>(memories_.size()), true, {}});
    pass.execute([=, this](graph::Resources& r) { Run(*this, r, batch, handles, any_hit).run(); });
    return handles.results;
}

/// Keeps the state of pages that are equal in all poses.
void PageServer::follow(const rays::ServedScene&) {
    if (std::exchange(serial_, pool_.scene().serial()) == pool_.scene().serial()) return;
    const std::size_t bytes = pool_.first_root(pool_.pages()) * sizeof(std::uint32_t);
    if (wanted_.bytes() != bytes) wanted_ = gpu::Buffer(wanted_.name(), bytes);
    if (queries_) queries_.emplace(pool_.source().index(), method_);
}

void PageServer::invalidate() {
    for (auto& [key, memory] : memories_) memory = {memory.number, true, {}};
    pool_.uses().forget();
    if (queries_) queries_->forget();
}

void PageServer::reset_statistics() {
    sums_ = {};
    pool_.reset_traffic();
}

std::size_t PageServer::state_bytes(const rays::RayBatch& batch) const {
    return keeps_ends(batch) ? batch.capacity * sizeof(float) : 0;
}

PagingStatistics PageServer::statistics() const {
    PagingStatistics s = sums_;
    s.traffic = pool_.traffic();
    s.slots = pool_.slots();
    s.pages = pool_.pages();
    return s;
}

}  // namespace halflight::paging
