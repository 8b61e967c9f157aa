#include "tools/bench/culling_methods.h"

#include <fmt/format.h>

#include <algorithm>

#include "engine/rays/raster.h"
#include "engine/rays/tracer.h"
#include "shaders/shared/tile_list.h"
#include "tools/bench/graph_run.h"
#include "tools/bench/viewpoint.h"

namespace halflight::bench {
namespace {

/// Runs whose mean is looked at.
constexpr int kLooks = 3;

std::function<Answers()> answers_of(const RaySet& set, const std::shared_ptr<GraphRun>& run) {
    return [&set, run] { return run->answers(set); };
}

// --- Tile lists -----------------------------------------------------------------------------------------------------

/// A ray set, a tracer that culls it by tile lists, and access to these.
class TileRun {
  public:
    TileRun(const Bench& bench, const RaySet& set)
        : set_(set),
          record_(bench.trace.statistics().node_format == rays::NodeFormat::grid ? shared::kTileTexels
                                                                                 : shared::kTileFloatTexels),
          tracer_(bench.trace, rays::Culling::compute),
          run_(bench.programs, set,
               [this](graph::Graph& graph, const rays::RayBatch& batch, graph::BufferHandle results, bool any) {
                   results = any ? rays::any_hit(graph, tracer_, batch, results)
                                 : rays::closest_hit(graph, tracer_, batch, results);
                   lists_ = named(graph, fmt::format("tile lists: {}", rays::name(batch.kind)));
                   rest_ = named(graph, "header of rays left");
                   graph.output(lists_);
                   graph.output(rest_);
                   return results;
               }) {
        run();  // only then there are lists
        forget();
    }

    void run() { run_.run(); }
    void forget() { run_.executor().buffer(lists_).clear(); }
    Answers answers() const { return run_.answers(set_); }

    /// Shares of time: cut, leaves, rest. Lists there are and made by a run, what is in them, and the rays that their
    /// leaves do not suffice for.
    std::vector<Figure> look(bool keep) {
        const std::uint64_t made = lists_made();
        run_.executor().measure(true);
        run_.executor().reset_times();
        for (int i = 0; i < kLooks; ++i) {
            if (!keep) forget();
            run();
        }
        run_.executor().measure(false);
        const Sizes sizes = list_sizes();
        const auto rest = run_.executor().read<shared::ListHeader>(rest_).front().count;
        const double all = seconds("");
        const auto per_list = [&](std::uint64_t sum) {
            return static_cast<double>(sum) / static_cast<double>(std::max<std::uint64_t>(sizes.lists, 1));
        };
        return {{"% cull", 100 * seconds(": cull") / all},
                {"% leaves", 100 * seconds(" hit") / all},
                {"% rest", 100 * seconds(": rest") / all},
                {"tiles", static_cast<double>(sizes.lists)},
                {"made", static_cast<double>(lists_made() - made) / kLooks},
                {"entries", per_list(sizes.entries)},
                {"leaves", per_list(sizes.leaves)},
                {"% to rest", 100.0 * rest / static_cast<double>(set_.live)}};
    }

  private:
    struct Sizes {
        std::uint64_t lists = 0, entries = 0, leaves = 0;
    };

    std::uint64_t lists_made() const { return tracer_.statistics().front().tiles_culled; }

    /// Of the passes whose name ends so.
    double seconds(std::string_view end) {
        double sum = 0;
        for (const graph::PassTime& pass : run_.executor().times())
            if (pass.name.ends_with(end)) sum += pass.seconds;
        return sum;
    }

    Sizes list_sizes() {
        const std::vector<uvec4> texels = run_.executor().read<uvec4>(lists_);
        Sizes sizes;
        for (std::size_t tile = 0; tile + record_ <= texels.size(); tile += record_) {
            if (texels[tile].w == 0) continue;  // no checksum: nobody has asked for it
            const std::uint32_t counts = texels[tile + 1].w;
            ++sizes.lists;
            sizes.leaves += counts & 0xffffu;
            sizes.entries += (counts & 0xffffu) + (counts >> 16);
        }
        return sizes;
    }

    const RaySet& set_;
    std::size_t record_;  // texels
    rays::Tracer tracer_;
    graph::BufferHandle lists_, rest_;
    GraphRun run_;
};

Method tile_method(const char* name, const Bench& bench, bool keep) {
    return {name, true, [bench, keep](const RaySet& set) -> Prepared {
                const auto run = std::make_shared<TileRun>(bench, set);
                Prepared prepared{.run = [run] { run->run(); },
                                  .answers = [run] { return run->answers(); },
                                  .figures = [run, keep] { return run->look(keep); }};
                if (!keep) prepared.before = [run] { run->forget(); };
                return prepared;
            }};
}

// --- Raster ---------------------------------------------------------------------------------------------------------

AddTrace add_raster(const Bench& bench, rays::RasterCulling& culling) {
    return [&trace = bench.trace, &culling](auto& graph, const auto& batch, auto results, bool any) {
        return any ? rays::raster_any_hit(graph, trace, culling, batch, results)
                   : rays::raster_closest_hit(graph, trace, culling, batch, results);
    };
}

/// Of a run that knows of one before.
std::vector<Figure> look_at_raster(const Bench& bench, const RaySet& set) {
    rays::RasterSettings settings;
    settings.measure = true;
    rays::RasterCulling culling(bench.packed, settings);
    GraphRun run(bench.programs, set, add_raster(bench, culling));
    run.run();
    culling.statistics(set.ray_kind) = {};
    run.run();
    const rays::RasterStatistics& s = culling.statistics(set.ray_kind);
    const auto count = [](std::size_t n) { return static_cast<double>(n); };
    return {{"queries", count(s.queries)},
            {"multi", count(s.multi_queries)},
            {"saved", count(s.saved_hidden + s.saved_visible)},
            {"waits", count(s.waits)},
            {"nodes", count(s.nodes)},
            {"leaves", count(s.leaves)},
            {"draws", count(s.traces)},
            {"pairs", count(s.pairs)},
            {"bounds ms", 1e3 * s.stages.bounds},
            {"ask ms", 1e3 * s.stages.ask},
            {"mark ms", 1e3 * s.stages.mark},
            {"trace ms", 1e3 * s.stages.trace},
            {"end ms", 1e3 * s.stages.end}};
}

}  // namespace

Method plain_method(const Bench& bench) {
    return {"plain", true, [bench](const RaySet& set) -> Prepared {
                const auto run = std::make_shared<GraphRun>(bench.programs, set, add_plain(bench));
                return {[run] { run->run(); }, answers_of(set, run)};
            }};
}

Method compute_method(const Bench& bench) {
    return tile_method("compute", bench, false);
}

Method kept_method(const Bench& bench) {
    return tile_method("kept", bench, true);
}

Method automatic_method(const Bench& bench) {
    return {"auto", true, [bench](const RaySet& set) -> Prepared {
                // More than the runs in which it tries what there is.
                constexpr int kTrials = 8;
                const auto tracer = std::make_shared<rays::Tracer>(bench.trace, rays::Culling::automatic);
                const auto run = std::make_shared<GraphRun>(
                    bench.programs, set, [tracer](auto& graph, const auto& batch, auto results, bool any) {
                        return any ? rays::any_hit(graph, *tracer, batch, results)
                                   : rays::closest_hit(graph, *tracer, batch, results);
                    });
                for (int i = 0; i < kTrials; ++i) run->run();
                const rays::BatchStatistics chosen = tracer->statistics().front();
                return {[run, tracer] { run->run(); },
                        answers_of(set, run),
                        fmt::format("{} ({})", rays::name(chosen.way), chosen.reason),
                        {},
                        {}};
            }};
}

/// What it has learned in the warm-up it knows in the turns.
Method raster_method(const Bench& bench) {
    const auto culling = std::make_shared<rays::RasterCulling>(bench.packed);
    return {"raster", true, [bench, culling](const RaySet& set) -> Prepared {
                culling->invalidate();
                const auto run = std::make_shared<GraphRun>(bench.programs, set, add_raster(bench, *culling));
                return {.run = [run, culling] { run->run(); },
                        .answers = answers_of(set, run),
                        .figures = [&set, bench] { return look_at_raster(bench, set); }};
            }};
}

}  // namespace halflight::bench
