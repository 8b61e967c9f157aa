#include "tools/measure/bench/culling_methods.h"

#include <fmt/format.h>

#include "engine/rays/native.h"
#include "engine/rays/raster.h"
#include "engine/rays/tracer.h"
#include "tools/measure/bench/graph_run.h"

namespace halflight::bench {
namespace {

std::function<Answers()> answers_of(const RaySet& set, const std::shared_ptr<GraphRun>& run) {
    return [&set, run] { return run->answers(set); };
}

// --- Tile lists -----------------------------------------------------------------------------------------------------

/// A ray set, a tracer that culls it by tile lists, and their state from run to run.
class TileRun {
  public:
    /// counts: calls Tracer::count().
    TileRun(const Bench& bench, const RaySet& set, bool counts)
        : tracer_(bench.trace, rays::Culling::compute, bench.tiles), run_(bench.programs, set, add(counts)) {
        run();  // creates the state that forget() clears
        forget();
    }

    void run() { run_.run(); }
    void forget() {
        run_.executor().history().invalidate("bench");
        for (const graph::BufferHandle handle : transient_) run_.executor().buffer(handle).clear();
    }
    Answers answers(const RaySet& set) const { return run_.answers(set); }
    rays::BatchStatistics statistics() const { return tracer_.statistics().front(); }

  private:
    AddTrace add(bool counts) {
        if (counts) tracer_.count();
        return [this](graph::Graph& graph, const rays::RayBatch& batch, graph::BufferHandle results, bool any) {
            results =
                any ? rays::any_hit(graph, tracer_, batch, results) : rays::closest_hit(graph, tracer_, batch, results);
            // Rays of a list change tiles between frames, so the graph carries no lists; here all runs are equal.
            if (batch.list) transient_ = {named(graph, "tile lists")};
            if (batch.list && any) transient_.push_back(named(graph, "blockers"));
            for (const graph::BufferHandle handle : transient_) graph.output(handle);
            return results;
        };
    }

    rays::Tracer tracer_;
    std::vector<graph::BufferHandle> transient_;  // buffers kept between runs although the graph does not carry them
    GraphRun run_;
};

/// Returns shares of time (cut, leaves, rest), and numbers of lists in use and made by a run. Further figures are mean
/// entries and leaves of a list, and the share of rays that need the rest.
std::vector<Figure> look_at_tiles(const Bench& bench, const RaySet& set, bool keep) {
    constexpr int kLooks = 3;  // number of runs that are averaged
    TileRun run(bench, set, true);
    run.run();
    const rays::BatchStatistics before = run.statistics();
    for (int i = 0; i < kLooks; ++i) {
        if (!keep) run.forget();
        run.run();
    }
    const rays::BatchStatistics after = run.statistics();
    const auto seconds = [&](double rays::BatchStatistics::Seconds::*step) {
        return after.steps.*step - before.steps.*step;
    };
    const auto count = [&](std::uint64_t rays::BatchStatistics::Lists::*sum) {
        return static_cast<double>(after.lists.*sum - before.lists.*sum);
    };
    using Steps = rays::BatchStatistics::Seconds;
    using Lists = rays::BatchStatistics::Lists;
    const double all = seconds(&Steps::cull) + seconds(&Steps::search) + seconds(&Steps::rest);
    return {{"% cull", 100 * seconds(&Steps::cull) / all},
            {"% leaves", 100 * seconds(&Steps::search) / all},
            {"% rest", 100 * seconds(&Steps::rest) / all},
            {"tiles", count(&Lists::tiles) / kLooks},
            {"made", static_cast<double>(after.tiles_culled - before.tiles_culled) / kLooks},
            {"entries", count(&Lists::entries) / count(&Lists::tiles)},
            {"leaves", count(&Lists::leaves) / count(&Lists::tiles)},
            {"% to rest", 100 * count(&Lists::rest_rays) / count(&Lists::rays)}};
}

Method tile_method(const char* name, const Bench& bench, bool keep) {
    return {name, true, [bench, keep](const RaySet& set) -> Prepared {
                const auto run = std::make_shared<TileRun>(bench, set, false);
                Prepared prepared{.run = [run] { run->run(); },
                                  .answers = [run, &set] { return run->answers(set); },
                                  .figures = [bench, &set, keep] { return look_at_tiles(bench, set, keep); }};
                if (!keep) prepared.before = [run] { run->forget(); };
                return prepared;
            }};
}

// --- Raster ---------------------------------------------------------------------------------------------------------

/// Returns figures of a run that has the state of an earlier one.
std::vector<Figure> look_at_raster(const Bench& bench, const RaySet& set) {
    rays::RasterSettings settings;
    settings.measure = true;
    rays::RasterCulling culling(bench.packed, settings);
    GraphRun run(bench.programs, set, add_served(bench, culling));
    run.run();
    culling.reset_statistics();
    run.run();
    const rays::RasterStatistics& s = culling.statistics(set.ray_kind, 0);
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
                // Number of runs, which suffices for all trials of Culling::automatic.
                constexpr int kTrials = 8;
                const auto tracer = std::make_shared<rays::Tracer>(bench.trace, rays::Culling::automatic, bench.tiles);
                const auto run = std::make_shared<GraphRun>(
                    bench.programs, set, [tracer](auto& graph, const auto& batch, auto results, bool any) {
                        return any ? rays::any_hit(graph, *tracer, batch, results)
                                   : rays::closest_hit(graph, *tracer, batch, results);
                    });
                for (int i = 0; i < kTrials; ++i) run->run();
                const rays::BatchStatistics chosen = tracer->statistics().front();
                return {[run, tracer] { run->run(); },
                        answers_of(set, run),
                        fmt::format("{} ({})", rays::name(chosen.method), chosen.reason),
                        {},
                        {}};
            }};
}

/// Returns the method `raster`, which keeps the state of the warm-up for the turns.
Method raster_method(const Bench& bench) {
    const auto culling = std::make_shared<rays::RasterCulling>(bench.packed);
    return {"raster", true, [bench, culling](const RaySet& set) -> Prepared {
                culling->invalidate();
                const auto run = std::make_shared<GraphRun>(bench.programs, set, add_served(bench, *culling));
                return {.run = [run, culling] { run->run(); },
                        .answers = answers_of(set, run),
                        .figures = [&set, bench] { return look_at_raster(bench, set); }};
            }};
}

Method native_method(const Bench& bench) {
    const auto native = std::make_shared<rays::NativeServer>(bench.tables, bench.trace);
    return {"native", true, [bench, native](const RaySet& set) -> Prepared {
                const auto run = std::make_shared<GraphRun>(bench.programs, set, add_served(bench, *native));
                return {.run = [run, native] { run->run(); },
                        .answers = answers_of(set, run),
                        .note = native->counts().note};
            }};
}

}  // namespace halflight::bench
