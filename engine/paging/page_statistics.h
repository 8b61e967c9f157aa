// Statistics of scenes that are loaded in pages. No OpenGL is used.
#pragma once

#include <cstdint>

namespace halflight::paging {

/// Counts since construction or reset.
struct PageTraffic {
    std::uint64_t loaded = 0;  // pages uploaded
    std::uint64_t moving = 0;  // uploaded pages of moving geometry, which are not read from files
    std::uint64_t evicted = 0;
    std::uint64_t bytes = 0;  // bytes uploaded
    double seconds = 0;       // seconds in which tracing waited for pages and their upload
};

/// Counts since construction or reset.
struct PagingStatistics {
    PageTraffic traffic;
    std::uint32_t slots = 0;  // pages that fit into the pool
    std::uint32_t pages = 0;  // pages of the scene
    std::uint64_t batches = 0;
    std::uint64_t rounds = 0;  // dispatches of the tracing kernel
    std::uint64_t again = 0;   // rays traced again
    // Pages loaded before a batch that used them or not. Both counts are 0 if all pages fit into the pool.
    std::uint64_t prefetched_used = 0;
    std::uint64_t prefetched_unused = 0;
    std::uint64_t queries = 0;  // batches that queried the hierarchy over all roots
    double query_seconds = 0;   // seconds of these queries
};

/// Counts of a pool of texture tiles since construction or reset.
struct TileStatistics {
    std::uint64_t tiles = 0;  // tiles of the scene; a tile of colour has 32 x 32 texels, one of data 64 x 32
    std::uint64_t slots = 0;  // tiles that fit into the pool
    std::uint64_t loaded = 0;
    std::uint64_t evicted = 0;
    std::uint64_t bytes = 0;    // bytes read from the file
    double seconds = 0;         // seconds of reading and uploading
    std::uint64_t batches = 0;  // batches of hits that were shaded
    std::uint64_t rounds = 0;   // dispatches of the shading kernel
    std::uint64_t again = 0;    // hits shaded again because a tile was missing; a hit counts each time
    std::uint64_t splits = 0;   // portions of batches that needed more tiles than the pool has
};

}  // namespace halflight::paging
