// Measures several methods on the same rays, in turns.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "engine/core/stopwatch.h"
#include "tools/measure/bench/method.h"

namespace halflight::bench {

/// Returns the duration of f() and of all GL work that it starts.
Seconds time_of(const std::function<void()>& f);

struct MethodResult {
    std::string method;
    std::string note;
    bool exact = false;
    std::vector<double> seconds;      // wall time by turn: the mean of its repeats
    std::vector<double> cpu_seconds;  // CPU time by turn, all threads
    // Rays whose answers differ from the plain tracer's; 0 without a plain tracer. For exact methods any bit differs;
    // for others only one of the two has a hit, or t differs by more than RaySet::tolerance.
    std::size_t different = 0;
    std::vector<Figure> figures;
};

struct KindResult {
    std::string kind;
    bool any_hit = false;
    std::size_t listed = 0;  // number of rays given to the methods
    std::size_t live = 0;    // number of rays that count in rates
    std::size_t hits = 0;    // number of hits of the first method
    std::vector<MethodResult> methods;
};

/// Runs each method `repeats` times in each of `turns` turns, after one turn to warm up. The order of the methods
/// changes from turn to turn. Calls between() between turns; an exception from it ends the measurement.
KindResult measure(const RaySet& set, const std::vector<Method>& methods, int turns, int repeats,
                   const std::function<void()>& between);

struct Quartiles {
    double lower = 0, median = 0, upper = 0;
};
Quartiles quartiles(const std::vector<double>& values);
/// Returns the quartiles of theirs / mine by turn, since the load of other programs changes slowly.
Quartiles speedup(const std::vector<double>& mine, const std::vector<double>& theirs);

}  // namespace halflight::bench
