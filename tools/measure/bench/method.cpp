#include "tools/measure/bench/method.h"
#include "tools/measure/bench/kernels.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>

#include "shaders/shared/bvh_nodes.h"
#include "tools/measure/bench/culling_methods.h"
#include "tools/measure/bench/graph_run.h"
#include "tools/measure/bench/naive_tracer.h"
#include "tools/measure/bench/paged_methods.h"
#include "tools/measure/bench/treelets.h"

namespace halflight::bench {
namespace {

// --- Ceiling --------------------------------------------------------------------------------------------------------

constexpr std::uint32_t kTreeletTriangles = 64;

/// Returns the passes of ceiling.comp. entries: reference and reference within a block, by path.
AddTrace add_ceiling(const Bench& bench, gpu::Buffer& entries) {
    return [&trace = bench.trace, &entries](graph::Graph& graph, const rays::RayBatch& batch,
                                            graph::BufferHandle results, bool any_hit) {
        gpu::Defines defines = trace.defines();
        if (any_hit) defines.set("HALFLIGHT_ANY_HIT");
        if (batch.list) defines.set("HALFLIGHT_LIST");
        graph::Pass pass = graph.add_pass("ceiling");
        pass.read(batch.rays, graph::Access::texture_read, {"rays", GL_RGBA32F});
        pass.read(graph.import_buffer("entries", entries), graph::Access::texture_read, {"entries", GL_RG32UI});
        if (batch.list) {
            pass.read(batch.list, graph::Access::storage_read, "List");
            pass.read(batch.list_header, graph::Access::indirect_read);
            pass.read(batch.list_header, graph::Access::storage_read, "Header");
        }
        results = pass.write(results, graph::Access::storage_write, any_hit ? "Occluded" : "Hits");
        pass.execute([=, &trace](graph::Resources& r) {
            const gpu::Program& program = r.kernel({gpu::bench_kernel("ceiling.comp"), defines});
            trace.bind();
            if (batch.list) {
                program.dispatch_indirect(r.buffer(batch.list_header), (batch.capacity + 63) / 64);
            } else {
                program.dispatch(batch.capacity / 64);
            }
        });
        return results;
    };
}

/// Returns the method `ceiling`. It is not exact: in a treelet, t is not raised to the entry of outer boxes.
Method ceiling_method(const Bench& bench) {
    const auto treelets = std::make_shared<Treelets>(bench.packed, bench.tables.triangles.size(), kTreeletTriangles);
    return {"ceiling", false, [bench, treelets](const RaySet& set) -> Prepared {
                RaySet closest = set;
                closest.any_hit = false;
                GraphRun plain(bench.programs, closest, add_plain(bench));
                plain.run();
                const std::vector<shared::Hit> hits = plain.results().read<shared::Hit>();

                const auto entries = std::make_shared<gpu::Buffer>("entries", set.rays.size() * sizeof(uvec2));
                const auto run = std::make_shared<GraphRun>(bench.programs, set, add_ceiling(bench, *entries));
                std::vector<uvec2> values(set.rays.size(), uvec2(0));
                std::vector<std::uint32_t> open;
                for (const std::uint32_t path : set.order)
                    if (hits[path].triangle != shared::kMiss) open.push_back(path);
                // A triangle may be split between treelets; the loop finds the treelet that contains the hit.
                for (std::size_t candidate = 0; !open.empty(); ++candidate) {
                    std::erase_if(open, [&](std::uint32_t path) {
                        const auto references = treelets->of(hits[path].triangle);
                        if (candidate == references.size()) return true;
                        const std::uint32_t instance = shared::kBvhTag | shared::kBvhInstance | hits[path].instance;
                        values[path] = bench.packed.two_level ? uvec2(instance, references[candidate])
                                                              : uvec2(references[candidate], 0);
                        return false;
                    });
                    entries->write(std::span<const uvec2>(values));
                    run->run();
                    const Answers answers = run->answers(set);
                    std::erase_if(open, [&](std::uint32_t path) {
                        return set.any_hit ? answers.occluded[path] == shared::kOccluded
                                           : answers.hits[path].triangle == hits[path].triangle &&
                                                 answers.hits[path].t == hits[path].t;
                    });
                }
                return {[run] { run->run(); },
                        [&set, run, entries] { return run->answers(set); },
                        fmt::format("{} treelets", treelets->count()),
                        {},
                        {}};
            }};
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
                        }};
            }};
}

// --- Embree ---------------------------------------------------------------------------------------------------------

Prepared embree_run(const EmbreeTracer& embree, const RaySet& set, EmbreeMode mode, bool coherent, std::string note) {
    const auto answers = std::make_shared<Answers>(empty_answers(set));
    return {[&embree, &set, mode, coherent, answers] { embree.trace(set, mode, coherent, *answers); },
            [answers] { return *answers; },
            std::move(note),
            {},
            {}};
}

Method embree_method(const Bench& bench) {
    return {"embree", false, [&embree = bench.embree](const RaySet& set) {
                return embree_run(embree, set, EmbreeMode::single, set.coherent, "");
            }};
}

/// Returns the method `packets`. Each mode runs once to warm up and twice for its time.
Method packets_method(const Bench& bench) {
    return {"packets", false, [&embree = bench.embree](const RaySet& set) {
                double best = std::numeric_limits<double>::infinity();
                Prepared fastest;
                for (const EmbreeMode mode : {EmbreeMode::packet8, EmbreeMode::packet16}) {
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
constexpr std::array kMethods{Entry{"naive", naive_method},           Entry{"plain", plain_method},
                              Entry{"compute", compute_method},       Entry{"kept", kept_method},
                              Entry{"auto", automatic_method},        Entry{"raster", raster_method},
                              Entry{"native", native_method},         Entry{"embree", embree_method},
                              Entry{"packets", packets_method},       Entry{"ceiling", ceiling_method},
                              Entry{"paged", paged_method},           Entry{"paged-cold", paged_cold_method},
                              Entry{"paged-half", paged_half_method}, Entry{"paged-quarter", paged_quarter_method}};

}  // namespace

const std::vector<std::string>& method_names() {
    static const std::vector<std::string> names = names_of(kMethods);
    return names;
}

Method make_method(const std::string& name, const Bench& bench) {
    return std::ranges::find(kMethods, name, &Entry::name)->make(bench);
}

}  // namespace halflight::bench
