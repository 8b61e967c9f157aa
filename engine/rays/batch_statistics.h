// Statistics of ray batches, by the tracer that serves them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "engine/rays/kinds.h"

namespace halflight::rays {

/// Statistics of the batches of one kind and depth over all runs and places of the picture.
struct BatchStatistics {
    std::string batch;     // name: "shadow", "continuation 2", ...
    Way way = Way::plain;  // method of the next run; with several places, of the first one
    std::string reason;    // reason for the method
    struct Measured {
        std::uint64_t runs = 0;
        std::uint64_t timed = 0;  // timed runs: all with Tracer::count(), otherwise those on trial
        double seconds = 0;       // sum over the timed runs
        double best = 0;          // shortest run; with several places, sum of their shortest runs
        std::uint64_t rays = 0;   // live rays over all runs, if counted
    };
    Measured measured[kWays];
    struct Seconds {
        double cull = 0;
        double search = 0;  // search in the leaves of the lists
        double rest = 0;    // search below the other entries of the lists
    };
    Seconds steps;                   // steps of runs by tiles
    std::uint64_t tiles = 0;         // tiles to cull, over all runs
    std::uint64_t tiles_culled = 0;  // number of lists made; the others were kept
    /// Sums over runs by tiles, if counted.
    struct Lists {
        std::uint64_t tiles = 0;  // tiles with a live ray
        std::uint64_t entries = 0;
        std::uint64_t leaves = 0;      // entries that are leaves
        std::uint64_t longest = 0;     // largest number of entries in a list, over all runs
        std::uint64_t rays = 0;        // live rays
        std::uint64_t rest_rays = 0;   // rays that did not end in the leaves of their tile
        std::uint64_t remembered = 0;  // any-hit rays ended by a leaf remembered from earlier runs
    };
    Lists lists;
    std::size_t state_bytes = 0;  // carried from run to run, over all places
};

/// Adds the statistics of the batch in another place. Method and reason do not change.
void add(BatchStatistics& to, const BatchStatistics& of);

}  // namespace halflight::rays
