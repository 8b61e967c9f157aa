// The plain tracer and Embree over the same rays, in turns.
#pragma once

#include <string>
#include <vector>

#include "engine/gpu/program.h"
#include "engine/rays/rays.h"
#include "tools/bench/embree_tracer.h"
#include "tools/bench/ray_kinds.h"

namespace halflight::bench {

struct Times {
    std::vector<double> seconds;      // wall clock, one per repeat
    std::vector<double> cpu_seconds;  // of the process, all threads
};

struct KindResult {
    std::string kind;
    std::size_t live = 0;
    Times plain;
    Times embree;
    std::size_t different = 0;  // rays that only one of the two has hit, or at another t
};

/// `repeats` turns after one to warm up.
KindResult measure(const RaySet& set, const rays::TraceScene& plain, const EmbreeTracer& embree,
                   gpu::ProgramCache& programs, int repeats);

}  // namespace halflight::bench
