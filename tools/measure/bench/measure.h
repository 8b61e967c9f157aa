// Methods over the same rays, in turns.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "engine/core/stopwatch.h"
#include "tools/measure/bench/method.h"

namespace halflight::bench {

/// Returns how long f() and all GL work that it starts take.
Seconds time_of(const std::function<void()>& f);

struct MethodResult {
    std::string method;
    std::string note;
    bool exact = false;
    std::vector<double> seconds;      // wall clock, one per turn: the mean of its repeats
    std::vector<double> cpu_seconds;  // of the process, all threads
    // From the plain tracer's: of an exact method, rays whose answers are not the same bit for bit; of others, rays
    // that only one of the two has hit, or at another t. 0 where there is no plain tracer.
    std::size_t different = 0;
    std::vector<Figure> figures;
};

struct KindResult {
    std::string kind;
    bool any_hit = false;
    std::size_t listed = 0;  // rays that are handed over
    std::size_t live = 0;    // rates count these
    std::size_t hits = 0;    // of the first method
    std::vector<MethodResult> methods;
};

/// `turns` turns after one to warm up, methods in another order each time; within a turn each method runs `repeats`
/// times. between() is called between turns; what it throws ends the measurement.
KindResult measure(const RaySet& set, const std::vector<Method>& methods, int turns, int repeats,
                   const std::function<void()>& between);

struct Quartiles {
    double lower = 0, median = 0, upper = 0;
};
Quartiles quartiles(const std::vector<double>& values);
/// How much faster `mine` is than `theirs`: of the ratios in each turn, since what else a machine does changes slowly.
Quartiles speedup(const std::vector<double>& mine, const std::vector<double>& theirs);

}  // namespace halflight::bench
