// What a tracer tells of the batches that it serves.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "engine/rays/kinds.h"

namespace halflight::rays {

/// What is known of one batch of a frame: those of one kind and depth, run after run, in whatever place.
struct BatchStatistics {
    std::string batch;     // "shadow", "continuation 2", ...
    Way way = Way::plain;  // that of the next run; of several places, in the first
    std::string reason;    // why
    struct Measured {
        std::uint64_t runs = 0;
        std::uint64_t timed = 0;  // of these: all with Tracer::count(), else those on trial
        double seconds = 0;       // of the runs timed, sum
        double best = 0;          // and least of one; of several places, the sum of theirs
        std::uint64_t rays = 0;   // that were alive, over all runs; where counted
    };
    Measured measured[kWays];
    struct Seconds {
        double cull = 0;
        double search = 0;  // of the lists' leaves
        double rest = 0;    // of what is below their other entries
    };
    Seconds steps;                   // of runs by tiles
    std::uint64_t tiles = 0;         // that had culling to do, over all runs
    std::uint64_t tiles_culled = 0;  // of these, lists that were made; the others were kept
    /// Sums over runs by tiles; where counted.
    struct Lists {
        std::uint64_t tiles = 0;  // with a ray alive
        std::uint64_t entries = 0;
        std::uint64_t leaves = 0;      // of the entries
        std::uint64_t longest = 0;     // entries; the greatest of all runs
        std::uint64_t rays = 0;        // alive
        std::uint64_t rest_rays = 0;   // of these, that had not ended with the leaves of their tile
        std::uint64_t remembered = 0;  // any-hit rays that a leaf remembered from earlier runs has ended
    };
    Lists lists;
    std::size_t state_bytes = 0;  // carried from run to run, of all places
};

/// Adds what is known of the batch in another place. Way and reason stay.
void add(BatchStatistics& to, const BatchStatistics& of);

}  // namespace halflight::rays
