#include "tools/bench/measure.h"

#include <sys/resource.h>

#include <cmath>

#include "engine/gpu/context.h"
#include "engine/graph/execute.h"

namespace halflight::bench {
namespace {

double cpu_seconds() {
    rusage usage;
    getrusage(RUSAGE_SELF, &usage);
    const auto seconds = [](const timeval& t) {
        return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
    };
    return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

template <class F>
void time_into(Times& times, const F& f) {
    const double cpu = cpu_seconds();
    times.seconds.push_back(gpu::timed(f));
    times.cpu_seconds.push_back(cpu_seconds() - cpu);
}

}  // namespace

KindResult measure(const RaySet& set, const rays::TraceScene& plain, const EmbreeTracer& embree,
                   gpu::ProgramCache& programs, int repeats) {
    const std::size_t result_bytes = set.any_hit ? sizeof(std::uint32_t) : sizeof(shared::Hit);
    gpu::Buffer rays = gpu::Buffer::from("rays", set.rays);
    gpu::Buffer results("results", set.rays.size() * result_bytes);
    graph::Graph graph;
    rays::RayBatch batch;
    batch.capacity = static_cast<std::uint32_t>(set.rays.size());
    batch.rays = graph.import_buffer("rays", rays);
    const graph::BufferHandle target = graph.import_buffer("results", results);
    graph.output(set.any_hit ? rays::any_hit(graph, plain, batch, target)
                             : rays::closest_hit(graph, plain, batch, target));
    const graph::CompiledGraph compiled = graph::compile(graph);
    graph::Executor executor(programs);

    std::vector<shared::Hit> hits(set.rays.size());
    std::vector<std::uint32_t> occluded(set.rays.size());
    const auto run_plain = [&] { executor.run(compiled); };
    const auto run_embree = [&] {
        if (set.any_hit) {
            embree.any(set.rays, occluded, set.coherent);
        } else {
            embree.closest(set.rays, hits, set.coherent);
        }
    };

    KindResult result{.kind = set.kind, .live = set.live, .plain = {}, .embree = {}, .different = 0};
    gpu::timed(run_plain);
    run_embree();
    for (int i = 0; i < repeats; ++i) {
        time_into(result.plain, run_plain);
        time_into(result.embree, run_embree);
    }

    if (set.any_hit) {
        const std::vector<std::uint32_t> mine = results.read<std::uint32_t>();
        for (std::size_t i = 0; i < mine.size(); ++i) result.different += mine[i] != occluded[i];
    } else {
        const std::vector<shared::Hit> mine = results.read<shared::Hit>();
        for (std::size_t i = 0; i < mine.size(); ++i) {
            const bool one = mine[i].triangle != shared::kMiss, other = hits[i].triangle != shared::kMiss;
            result.different +=
                one != other || (one && std::abs(mine[i].t - hits[i].t) > set.tolerance + 1e-5f * hits[i].t);
        }
    }
    return result;
}

}  // namespace halflight::bench
