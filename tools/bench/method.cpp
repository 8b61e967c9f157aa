#include "tools/bench/method.h"

#include <algorithm>
#include <array>
#include <limits>

#include "engine/graph/compile.h"
#include "engine/graph/execute.h"
#include "engine/rays/raster.h"
#include "tools/bench/naive_tracer.h"

namespace halflight::bench {
namespace {

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

// --- Tracers of the engine: passes of a graph ----------------------------------------------------------------------

/// Adds the passes that answer a batch; returns the answers.
using AddTrace =
    std::function<graph::BufferHandle(graph::Graph&, const rays::RayBatch&, graph::BufferHandle results, bool any_hit)>;

struct GraphRun {
    GraphRun(gpu::ProgramCache& programs, const RaySet& set, const AddTrace& add)
        : rays(gpu::Buffer::from("rays", set.rays)),
          list(gpu::Buffer::from("list", set.listed ? set.order : std::vector<std::uint32_t>{})),
          header("list header", sizeof(shared::ListHeader)),
          results("results", set.rays.size() * answer_bytes(set)),
          executor(programs) {
        const auto count = static_cast<std::uint32_t>(set.order.size());
        const shared::ListHeader head{(count + 63) / 64, 1, 1, count};
        header.write(0, sizeof(head), &head);
        graph::Graph graph;
        rays::RayBatch batch;
        batch.kind = set.ray_kind;
        batch.capacity = static_cast<std::uint32_t>(set.rays.size());
        batch.rays = graph.import_buffer("rays", rays);
        if (set.listed) {
            batch.list = graph.import_buffer("list", list);
            batch.list_header = graph.import_buffer("list header", header);
        }
        graph.output(add(graph, batch, graph.import_buffer("results", results), set.any_hit));
        compiled = graph::compile(graph);
    }

    gpu::Buffer rays, list, header, results;
    graph::CompiledGraph compiled;
    graph::Executor executor;
};

/// start(): called once for each ray set, before all else.
Method graph_method(
    const std::string& name, const Bench& bench, const AddTrace& add, const std::function<void()>& start = [] {}) {
    return {name, true, [&programs = bench.programs, add, start](const RaySet& set) -> Prepared {
                start();
                const auto run = std::make_shared<GraphRun>(programs, set, add);
                const auto read = [run, any_hit = set.any_hit] {
                    return any_hit ? Answers{{}, run->results.read<std::uint32_t>()}
                                   : Answers{run->results.read<shared::Hit>(), {}};
                };
                return {[run] { run->executor.run(run->compiled); }, read, ""};
            }};
}

Method plain_method(const Bench& bench) {
    return graph_method("plain", bench, [&trace = bench.trace](auto& graph, const auto& batch, auto results, bool any) {
        return any ? rays::any_hit(graph, trace, batch, results) : rays::closest_hit(graph, trace, batch, results);
    });
}

/// What it has learned in the warm-up it knows in the turns.
Method raster_method(const Bench& bench) {
    const auto culling = std::make_shared<rays::RasterCulling>(bench.tables, bench.packed);
    return graph_method(
        "raster", bench,
        [&trace = bench.trace, culling](auto& graph, const auto& batch, auto results, bool any) {
            return any ? rays::raster_any_hit(graph, trace, *culling, batch, results)
                       : rays::raster_closest_hit(graph, trace, *culling, batch, results);
        },
        [culling] { culling->invalidate(); });
}

// --- Naive ----------------------------------------------------------------------------------------------------------

Method naive_method(const Bench& bench) {
    const auto tracer = std::make_shared<NaiveTracer>(bench.tables, bench.context.limits().storage_block_bytes);
    return {"naive", false, [&programs = bench.programs, tracer](const RaySet& set) -> Prepared {
                std::vector<shared::Ray> rays;
                rays.reserve(set.scanline.size());
                for (const std::uint32_t path : set.scanline) rays.push_back(set.rays[path]);
                struct Buffers {
                    gpu::Buffer rays, results;
                };
                const auto buffers = std::make_shared<Buffers>(
                    Buffers{gpu::Buffer::from("rays", rays), {"results", rays.size() * answer_bytes(set)}});
                const auto count = static_cast<std::uint32_t>(rays.size());
                return {[=, &programs, any_hit = set.any_hit] {
                            tracer->trace(programs, buffers->rays, count, any_hit, buffers->results);
                        },
                        [&set, buffers] {
                            Answers answers = empty_answers(set);
                            const auto scatter = [&]<class T>(std::vector<T>& to) {
                                const std::vector<T> from = buffers->results.read<T>();
                                for (std::size_t i = 0; i < from.size(); ++i) to[set.scanline[i]] = from[i];
                            };
                            set.any_hit ? scatter(answers.occluded) : scatter(answers.hits);
                            return answers;
                        },
                        ""};
            }};
}

// --- Embree ---------------------------------------------------------------------------------------------------------

Prepared embree_run(const EmbreeTracer& embree, const RaySet& set, EmbreeMode mode, bool coherent, std::string note) {
    const auto answers = std::make_shared<Answers>(empty_answers(set));
    return {[&embree, &set, mode, coherent, answers] { embree.trace(set, mode, coherent, *answers); },
            [answers] { return *answers; }, std::move(note)};
}

Method embree_method(const Bench& bench) {
    return {"embree", false, [&embree = bench.embree](const RaySet& set) {
                return embree_run(embree, set, EmbreeMode::single, set.coherent, "");
            }};
}

/// Each mode runs once to warm up and twice for its time.
Method packets_method(const Bench& bench) {
    return {"packets", false, [&embree = bench.embree](const RaySet& set) {
                double best = std::numeric_limits<double>::infinity();
                Prepared fastest;
                for (const EmbreeMode mode :
                     {EmbreeMode::packet8, EmbreeMode::packet16, EmbreeMode::stream, EmbreeMode::packets}) {
                    for (const bool coherent : {false, true}) {
                        if (!embree.supports(set, mode, coherent)) continue;
                        Prepared run = embree_run(embree, set, mode, coherent,
                                                  std::string(name(mode)) + (coherent ? ", coherent" : ", incoherent"));
                        run.run();
                        const double seconds = std::min(gpu::timed(run.run), gpu::timed(run.run));
                        if (seconds < best) fastest = std::move(run);
                        best = std::min(best, seconds);
                    }
                }
                return fastest;
            }};
}

struct Entry {
    const char* name;
    Method (*make)(const Bench&);
};
constexpr std::array kMethods{Entry{"naive", naive_method}, Entry{"plain", plain_method},
                              Entry{"raster", raster_method}, Entry{"embree", embree_method},
                              Entry{"packets", packets_method}};

}  // namespace

const std::vector<std::string>& method_names() {
    static const std::vector<std::string> names = [] {
        std::vector<std::string> n;
        for (const Entry& method : kMethods) n.emplace_back(method.name);
        return n;
    }();
    return names;
}

Method make_method(const std::string& name, const Bench& bench) {
    return std::ranges::find(kMethods, name, &Entry::name)->make(bench);
}

}  // namespace halflight::bench
