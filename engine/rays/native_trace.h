// Traces rays by vector code of the processor (native.h). No OpenGL is used; the code may run in several threads.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "engine/rays/native_tree.h"
#include "shaders/shared/ray_structs.h"

namespace halflight::rays {

/// A batch of rays in memory.
struct NativeJob {
    const NativeTree* tree = nullptr;
    const vec4* pairs = nullptr;  // kBvhPairTexels per pair, as in shaders/shared/bvh_nodes.h
    bool alpha_tested = false;    // TraceTables::alpha_tested
    bool slivers = false;         // TraceTables::slivers
    int backfaces = 0;            // value of HALFLIGHT_BACKFACES; 0: all rays meet back faces
    bool passes_panes = false;    // RayBatch::passes_panes
    bool any_hit = false;
    bool together = false;                // traces 64 consecutive rays together; affects time only
    const shared::Ray* rays = nullptr;    // rays by path
    const std::uint32_t* list = nullptr;  // paths to trace; null: all
    // Array of blockers_of(rays) words, which is read and written; needed with any_hit and `together`. An entry is the
    // place of the leaf that last ended rays of a vector. Any content is valid and affects time only.
    std::uint32_t* blockers = nullptr;
    void* results = nullptr;  // shared::Hit, or std::uint32_t with any_hit, by path

    /// Returns whether a ray passes back faces of one-sided triangles.
    bool passes_backs(float t_min) const {
        return backfaces == shared::kEveryRay || (backfaces == shared::kMarkedRays && t_min > 0);
    }
};

/// Returns the number of NativeJob::blockers for this number of rays: one for each vector, which has 8 rays or more,
/// and those of a whole last tile.
constexpr std::size_t blockers_of(std::size_t rays) {
    return rays / 8 + 8;
}

/// Returns whether the processor has the vectors that trace_native() needs.
bool can_trace_natively();
/// Traces the entries [begin, end) of the list, or the paths. Appends to `delegated` the paths whose results have not
/// been written: their rays need an alpha test, or are out of range. Threads may call it for disjoint entries if each
/// `begin` is a multiple of 64.
void trace_native(const NativeJob& job, std::size_t begin, std::size_t end, std::vector<std::uint32_t>& delegated);

}  // namespace halflight::rays
