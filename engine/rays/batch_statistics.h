// Statistics of the batches that a tracer serves.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "engine/rays/kinds.h"

namespace halflight::rays {

/// Statistics of the batches of one kind and depth, over all runs and places.
struct BatchStatistics {
    std::string batch;                        // name of the batch: "shadow", "continuation 2", ...
    TraceMethod method = TraceMethod::plain;  // method of the next run, at the batch's first place
    std::string reason;                       // reason why this method was chosen
    struct Measured {
        std::uint64_t runs = 0;
        std::uint64_t timed = 0;  // timed runs: all with Tracer::count(), otherwise those on trial
        double seconds = 0;       // seconds, sum over timed runs
        double best = 0;          // fastest timed run, seconds; summed over places
        std::uint64_t rays = 0;   // live rays, sum over runs; 0 unless counted
    };
    Measured measured[kTraceMethods];
    struct Seconds {
        double cull = 0;
        double search = 0;  // seconds of searching the lists' leaves
        double rest = 0;    // seconds of searching the subtrees of the other entries
    };
    Seconds steps;                   // seconds, sums over runs by tiles
    std::uint64_t tiles = 0;         // tiles of all runs by tiles
    std::uint64_t tiles_culled = 0;  // tiles whose list was made anew; the other lists were kept
    /// Sums over runs by tiles; 0 unless counted.
    struct Lists {
        std::uint64_t tiles = 0;       // tiles with a live ray
        std::uint64_t entries = 0;     // number of list entries
        std::uint64_t leaves = 0;      // entries that are leaves
        std::uint64_t longest = 0;     // entries of the longest list of all runs
        std::uint64_t rays = 0;        // live rays
        std::uint64_t rest_rays = 0;   // live rays that searched more than the leaves of their tile
        std::uint64_t remembered = 0;  // any-hit rays ended by a leaf remembered from earlier runs
    };
    Lists lists;
    /// Tasks of native tracing, by the way that rays went: one by one in turns, or 64 together.
    struct NativeTasks {
        double rays = 0, seconds = 0;  // sums; seconds: of all threads
    };
    NativeTasks native_alone, native_together;
    std::size_t state_bytes = 0;  // bytes of state carried from run to run, sum over places
};

/// Adds the statistics of the batch in another place. Method and reason stay those of `to`.
void add(BatchStatistics& to, const BatchStatistics& of);

}  // namespace halflight::rays
