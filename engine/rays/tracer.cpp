#include "engine/rays/tracer.h"

#include <epoxy/gl.h>

#include "engine/core/error.h"
#include "engine/graph/execute.h"
#include "engine/rays/native.h"
#include "engine/rays/tracer_batch.h"
#include "shaders/shared/ray_structs.h"
#include "shaders/shared/tile_list.h"

namespace halflight::rays {
namespace {

using graph::Access;

std::string name_of(const BatchKey& batch) {
    return batch.depth == 0 ? name(batch.kind) : fmt::format("{} {}", name(batch.kind), batch.depth);
}

/// Returns the name of a resource carried for a batch.
std::string carried_name(const char* what, const RayBatch& batch) {
    const std::string name = fmt::format("{}: {}", what, name_of(key_of(batch)));
    return batch.place == 0 ? name : fmt::format("{}, place {}", name, batch.place);
}

graph::BufferHandle carried_lists(graph::Graph& graph, const Tracer& tracer, const RayBatch& batch) {
    return graph.carried_buffer(carried_name("tile lists", batch),
                                {tile_list_bytes(tracer.scene(), batch, tracer.tile_settings())});
}

void check_storage_block(std::size_t bytes) {
    GLint64 limit = 0;
    glGetInteger64v(GL_MAX_SHADER_STORAGE_BLOCK_SIZE, &limit);
    if (bytes > static_cast<std::size_t>(limit))
        throw Error("rays", "tile lists of {} bytes; the driver's storage blocks end at {}", bytes, limit);
}

}  // namespace

Tracer::Tracer(const TraceScene& scene, Culling culling, const TileSettings& tiles)
    : scene_(scene), culling_(culling), tiles_(tiles) {
    if (row_of(culling).make_server) throw Error("rays", "{} culling is a server of its own", name(culling));
    if (tiles.side != 8 && tiles.side != 16) throw Error("rays", "tiles of {0}x{0} pixels", tiles.side);
    if (tiles.capacity < 1 || tiles.capacity > std::uint32_t{shared::kMostTileEntries}) {
        throw Error("rays", "tile lists of {} entries", tiles.capacity);
    }
}

Tracer::Tracer(const TraceScene& scene, BatchServer& server)
    : scene_(scene), culling_(Culling::off), server_(&server) {}

Tracer::~Tracer() = default;

void Tracer::invalidate() {
    for (auto& [key, batch] : batches_) batch->forget();
    if (server_ != nullptr) server_->invalidate();
}

void Tracer::reset_statistics() {
    for (auto& [key, batch] : batches_) batch->reset_statistics();
    if (server_ != nullptr) server_->reset_statistics();
    if (native_ != nullptr) native_->reset_statistics();
}

std::vector<BatchStatistics> Tracer::statistics() const {
    std::vector<BatchStatistics> all;
    BatchKey last;
    for (const auto& [key, batch] : batches_) {
        if (!all.empty() && key.kind == last.kind && key.depth == last.depth) {
            add(all.back(), batch->statistics());
        } else {
            all.push_back(batch->statistics());
        }
        if (const NativeServer* const server = native(); server != nullptr) server->add_tasks(key, all.back());
        last = key;
    }
    if (const std::string off = note(); !off.empty()) {
        for (BatchStatistics& batch : all) {
            if (batch.method == TraceMethod::native) batch.reason = off;
        }
    }
    return all;
}

std::string Tracer::note() const {
    const NativeServer* const server = native();
    return server != nullptr ? server->counts().note : "";
}

const NativeServer* Tracer::native() const {
    return native_ != nullptr ? native_ : dynamic_cast<const NativeServer*>(server_);
}

bool Tracer::ran_by_tiles(const RayBatch& rays) const {
    const auto found = batches_.find(key_of(rays));
    return found != batches_.end() && found->second->ran() == TraceMethod::tiles;
}

std::uint64_t Tracer::first_runs() const {
    return native_ != nullptr ? kFirstNativeRuns : Choice::kFirstRuns;
}

void Tracer::expect(std::uint64_t runs) {
    short_ = culling_ == Culling::automatic && runs <= first_runs();
}

bool Tracer::may_cull_by_tiles(const RayBatch& rays) const {
    if (culling_ != Culling::automatic) return culling_ == Culling::compute;
    // Tiles speed up short rays even if lists are made anew each time, but not longer rays of a list. No pass has
    // occlusion batches; the benchmark has them.
    return !short_ && (!rays.list || rays.kind == RayKind::occlusion);
}

Tracer::Batch& Tracer::batch(const RayBatch& rays) {
    const BatchKey key = key_of(rays);
    std::unique_ptr<Batch>& found = batches_[key];
    if (!found) {
        std::vector<TraceMethod> methods;
        std::string reason;
        if (server_ != nullptr) {
            methods = {server_->method()};
            reason = "it was asked for";
        } else if (culling_ == Culling::compute) {
            methods = {TraceMethod::tiles};
            reason = "compute culling was asked for";
        } else {
            methods = {native_ != nullptr ? TraceMethod::native : TraceMethod::plain};
            if (culling_ == Culling::off) {
                reason = "culling is off";
            } else if (short_) {
                reason = "so few runs end before culling could pay";
            } else if (!may_cull_by_tiles(rays)) {
                reason = "rays of a list have no lasting place in tiles";
            } else {
                methods.push_back(TraceMethod::tiles);
            }
        }
        found = std::make_unique<Batch>(name_of(key), std::move(methods), first_runs(), std::move(reason), counts_);
    }
    return *found;
}

/// The passes of one batch in one graph.
class BatchRun {
  public:
    BatchRun(graph::Graph& graph, Tracer& tracer, const RayBatch& batch, bool any_hit)
        : graph_(graph),
          tracer_(tracer),
          scene_(tracer.scene_),
          batch_(batch),
          any_hit_(any_hit),
          state_(&tracer.batch(batch)),
          label_(fmt::format("{} rays", name(batch.kind))) {
        tiles_.settings = tracer.tile_settings();
    }

    graph::BufferHandle add(graph::BufferHandle results) {
        if (tracer_.may_cull_by_tiles(batch_)) {
            results = add_tiles(results);
        } else {
            if (tracer_.counts_) add_start();
            results = add_whole(results);
        }
        if (tracer_.counts_) add_count();
        return results;
    }

  private:
    graph::BufferHandle add_whole(graph::BufferHandle results) {
        if (tracer_.server_ != nullptr) {
            state_->set_state_bytes(tracer_.server_->state_bytes(batch_));
            return tracer_.server_->add(graph_, scene_, batch_, results, any_hit_);
        }
        if (tracer_.native_ != nullptr) return tracer_.native_->add(graph_, scene_, batch_, results, any_hit_);
        return any_hit_ ? any_hit(graph_, scene_, batch_, results) : closest_hit(graph_, scene_, batch_, results);
    }

    graph::BufferHandle add_tiles(graph::BufferHandle results) {
        create_buffers();
        add_cull();
        results = add_search(results);
        results = add_rest(results);
        if (!batch_.list) {
            graph_.output(tiles_.lists);
            if (any_hit_) graph_.output(tiles_.blockers);
        }
        return results;
    }

    void create_buffers() {
        const std::size_t bytes = tile_list_bytes(scene_, batch_, tiles_.settings);
        const std::size_t masks = tile_count(batch_, tiles_.settings) * sizeof(shared::TileBlockers);
        if (batch_.list) {
            tiles_.lists = graph_.create_buffer("tile lists", {bytes});
            if (any_hit_) tiles_.blockers = graph_.create_buffer("blockers", {masks});
        } else {
            tiles_.lists = carried_lists(graph_, tracer_, batch_);
            if (any_hit_) tiles_.blockers = graph_.carried_buffer(carried_name("blockers", batch_), {masks});
            state_->set_state_bytes(bytes + (any_hit_ ? masks : 0));
        }
        tiles_.rest = graph_.create_buffer("rays left", {rest_bytes(batch_, tiles_.settings)});
        tiles_.rest_header = graph_.create_buffer("header of rays left", {sizeof(shared::RestHeader)});
        tiles_.counts = tracer_.counts_;
    }

    /// Times f if required, which waits for the GPU.
    template <class F>
    auto timed(Tracer::Batch::Step step, F f) const {
        return [=, batch = state_](graph::Resources& r) {
            if (batch->measuring()) {
                batch->add(step, gpu::timed([&] { f(r); }));
            } else {
                f(r);
            }
        };
    }

    void add_cull() {
        graph::Pass pass = graph_.add_pass(label_ + ": cull");
        read_batch(pass, scene_, batch_);
        // Lists for the rays of a list are made anew; their memory holds no earlier lists.
        const Access update = batch_.list ? Access::storage_write : Access::storage_read_write;
        tiles_.lists = pass.write(tiles_.lists, update);
        if (any_hit_) tiles_.blockers = pass.write(tiles_.blockers, update);
        const auto cull = [&scene = scene_, rays = batch_, tiles = tiles_, any = any_hit_,
                           batch = state_](graph::Resources& r) {
            if (batch->method() != TraceMethod::tiles) return;
            check_storage_block(tile_list_bytes(scene, rays, tiles.settings));
            cull_tiles(r, scene, rays, tiles, any, batch->culled());
        };
        pass.execute([batch = state_, step = timed(&BatchStatistics::Seconds::cull, cull)](graph::Resources& r) {
            batch->begin();
            step(r);
        });
    }

    graph::BufferHandle add_search(graph::BufferHandle results) {
        graph::Pass pass = graph_.add_pass(label_ + (any_hit_ ? ": any hit" : ": closest hit"));
        read_batch(pass, scene_, batch_);
        pass.read(tiles_.lists, Access::texture_read);
        if (any_hit_) tiles_.blockers = pass.write(tiles_.blockers, Access::storage_read_write);
        tiles_.rest_header = pass.write(tiles_.rest_header, Access::storage_write);
        tiles_.rest = pass.write(tiles_.rest, Access::storage_write);
        results = write_results(pass, batch_, results);
        const auto search = [&scene = scene_, rays = batch_, tiles = tiles_, results, any = any_hit_,
                             native = tracer_.native_, batch = state_](graph::Resources& r) {
            if (batch->method() == TraceMethod::native) {
                native->trace(r, scene, rays, results, any);
            } else if (batch->method() == TraceMethod::plain) {
                trace_plain(r, scene, rays, results, any);
            } else {
                search_tiles(r, scene, rays, tiles, results, any);
            }
        };
        pass.execute(timed(&BatchStatistics::Seconds::search, search));
        return results;
    }

    graph::BufferHandle add_rest(graph::BufferHandle results) {
        graph::Pass pass = graph_.add_pass(label_ + ": rest");
        read_batch(pass, scene_, batch_);
        pass.read(tiles_.lists, Access::texture_read);
        pass.read(tiles_.rest, Access::storage_read);
        pass.read(tiles_.rest_header, Access::storage_read);
        pass.read(tiles_.rest_header, Access::indirect_read);
        results = pass.write(results, Access::storage_read_write);
        const auto rest = [&scene = scene_, rays = batch_, tiles = tiles_, results, any = any_hit_,
                           batch = state_](graph::Resources& r) {
            if (batch->method() == TraceMethod::tiles) search_rest(r, scene, rays, tiles, results, any);
        };
        pass.execute([batch = state_, count = tile_count(batch_, tiles_.settings),
                      step = timed(&BatchStatistics::Seconds::rest, rest)](graph::Resources& r) {
            step(r);
            batch->end(batch->method() == TraceMethod::tiles ? count : 0);
        });
        return results;
    }

    void add_start() {
        graph::Pass pass = graph_.add_pass(label_ + ": count");
        pass.keep();
        pass.execute([batch = state_](graph::Resources&) { batch->start(); });
    }

    void add_count() {
        const bool tiles = tracer_.may_cull_by_tiles(batch_);
        graph::Pass pass = graph_.add_pass(label_ + ": count");
        pass.keep();
        read_batch(pass, scene_, batch_);
        if (tiles) {
            pass.read(tiles_.lists, Access::texture_read);
            pass.read(tiles_.rest_header, Access::transfer_read);
        }
        pass.execute([&scene = scene_, rays = batch_, kept = tiles_, tiles, batch = state_](graph::Resources& r) {
            if (!tiles) batch->stop();
            const bool ran_by_tiles = batch->ran() == TraceMethod::tiles;
            const auto rest =
                ran_by_tiles ? r.buffer(kept.rest_header).read<shared::RestHeader>(0, 1).front() : shared::RestHeader{};
            batch->count(count_batch(r, scene, rays, kept.settings, ran_by_tiles ? kept.lists : graph::BufferHandle()),
                         rest);
        });
    }

    graph::Graph& graph_;
    Tracer& tracer_;
    const TraceScene& scene_;
    const RayBatch batch_;
    const bool any_hit_;
    Tracer::Batch* state_;
    const std::string label_;
    TileBuffers tiles_;
};

graph::BufferHandle closest_hit(graph::Graph& graph, Tracer& tracer, const RayBatch& batch, graph::BufferHandle hits) {
    return BatchRun(graph, tracer, batch, false).add(hits);
}

graph::BufferHandle any_hit(graph::Graph& graph, Tracer& tracer, const RayBatch& batch, graph::BufferHandle occluded) {
    return BatchRun(graph, tracer, batch, true).add(occluded);
}

graph::BufferHandle kept_lists(graph::Graph& graph, const Tracer& tracer, const RayBatch& batch) {
    if (batch.list || !tracer.may_cull_by_tiles(batch)) return {};
    return carried_lists(graph, tracer, batch);
}

}  // namespace halflight::rays
