#include "tools/measure/bench/measure.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>
#include <random>

#include "engine/core/statistics.h"

namespace halflight::bench {
namespace {

using shared::Hit;

bool same_bits(float a, float b) {
    return std::bit_cast<std::uint32_t>(a) == std::bit_cast<std::uint32_t>(b);
}

bool same(const Hit& a, const Hit& b) {
    const bool miss = a.triangle == shared::kMiss && b.triangle == shared::kMiss;
    return same_bits(a.t, b.t) && (miss || (same_bits(a.u, b.u) && same_bits(a.v, b.v) && a.triangle == b.triangle &&
                                            a.instance == b.instance));
}

bool close(const Hit& a, const Hit& b, float tolerance) {
    const bool one = a.triangle != shared::kMiss, other = b.triangle != shared::kMiss;
    return one == other && (!one || std::abs(a.t - b.t) <= tolerance + 1e-5f * b.t);
}

std::size_t count_different(const RaySet& set, const Answers& a, const Answers& b, bool exact) {
    return static_cast<std::size_t>(std::ranges::count_if(set.order, [&](std::uint32_t path) {
        if (set.any_hit) return a.occluded[path] != b.occluded[path];
        return exact ? !same(a.hits[path], b.hits[path]) : !close(a.hits[path], b.hits[path], set.tolerance);
    }));
}

std::size_t count_hits(const RaySet& set, const Answers& a) {
    return static_cast<std::size_t>(std::ranges::count_if(set.order, [&](std::uint32_t path) {
        return set.any_hit ? a.occluded[path] == shared::kOccluded : a.hits[path].triangle != shared::kMiss;
    }));
}

Seconds run_once(const Prepared& prepared) {
    if (prepared.before) prepared.before();
    return time_of(prepared.run);
}

}  // namespace

Seconds time_of(const std::function<void()>& f) {
    gpu::finish();
    const CpuStopwatch watch;
    f();
    gpu::finish();
    return watch.seconds();
}

KindResult measure(const RaySet& set, const std::vector<Method>& methods, int turns, int repeats,
                   const std::function<void()>& between) {
    KindResult result{set.kind, set.any_hit, set.order.size(), set.live, 0, {}};
    std::vector<Prepared> runs;
    for (const Method& method : methods) {
        runs.push_back(method.prepare(set));
        run_once(runs.back());
        result.methods.push_back({method.name, runs.back().note, method.exact, {}, {}, 0, {}});
    }

    std::vector<std::size_t> order(methods.size());
    std::iota(order.begin(), order.end(), 0);
    std::mt19937 random(1);
    for (int turn = 0; turn < turns; ++turn) {
        between();
        std::ranges::shuffle(order, random);
        for (const std::size_t m : order) {
            Seconds sum;
            for (int i = 0; i < repeats; ++i) {
                const Seconds seconds = run_once(runs[m]);
                sum.wall += seconds.wall;
                sum.cpu += seconds.cpu;
            }
            result.methods[m].seconds.push_back(sum.wall / repeats);
            result.methods[m].cpu_seconds.push_back(sum.cpu / repeats);
        }
    }

    std::vector<Answers> answers;
    for (const Prepared& run : runs) answers.push_back(run.answers());
    result.hits = count_hits(set, answers.front());
    const auto plain = std::ranges::find(methods, "plain", &Method::name);
    if (plain != methods.end()) {
        for (std::size_t m = 0; m < methods.size(); ++m) {
            result.methods[m].different = count_different(
                set, answers[m], answers[static_cast<std::size_t>(plain - methods.begin())], methods[m].exact);
        }
    }
    for (std::size_t m = 0; m < methods.size(); ++m)
        if (runs[m].figures) result.methods[m].figures = runs[m].figures();
    return result;
}

Quartiles quartiles(const std::vector<double>& values) {
    return {quantile(values, 0.25), median(values), quantile(values, 0.75)};
}

Quartiles speedup(const std::vector<double>& mine, const std::vector<double>& theirs) {
    std::vector<double> ratios(mine.size());
    std::ranges::transform(theirs, mine, ratios.begin(), std::divides<>());
    return quartiles(ratios);
}

}  // namespace halflight::bench
