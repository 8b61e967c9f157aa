// Culling by compute, a back end of CHC+RT (Mattausch, Bittner, Jaspe, Gobbetti, Wimmer, Pajarola 2015, CHC+RT:
// Coherent Hierarchical Culling for Ray Tracing, Computer Graphics Forum 34(2)).
//
// The kernel shaders/cull.comp cuts the hierarchy per tile of rays. The kernel shaders/trace_tiles.comp searches the
// leaves of this cut, and shaders/trace_rest.comp, for the remaining rays, the subtrees of its other entries.
//
// Hits equal those of the plain tracer bit for bit. However, a search that the driver would cut short may end here,
// because it is divided.
#pragma once

#include <cstdint>

#include "engine/gpu/buffer.h"
#include "engine/graph/execute.h"
#include "engine/rays/rays.h"
#include "shaders/shared/tile_list.h"

namespace halflight::rays {

/// Rays per list and capacity of a list; both affect time only.
struct TileSettings {
    std::uint32_t side = 8;       // pixels along x and y: 8 or 16
    std::uint32_t capacity = 32;  // entries: 1 to kMostTileEntries of shaders/shared/tile_list.h
};

/// Buffers of a batch.
struct TileBuffers {
    TileSettings settings;
    graph::BufferHandle lists;        // a record of shaders/shared/tile_list.h per tile; any content is valid
    graph::BufferHandle blockers;     // TileBlockers per tile, for any_hit() only; any content is valid
    graph::BufferHandle rest_header;  // one RestHeader
    graph::BufferHandle rest;         // rest_bytes() bytes of rays for search_rest()
    bool counts = false;              // true: RestHeader::remembered is filled in
    // Per ray, a float beyond which nodes do not count for cull_tiles(); null: its t_max.
    const gpu::Buffer* ends = nullptr;
    bool finest = false;  // for cull_tiles() alone: refines nodes of any size while the list has room
};

/// Returns the rays per tile: side^2, or 16 if paths have several rays. These 16 connect the receivers of a group
/// with one point, or the receivers of smaller groups with a few points.
std::uint32_t tile_rays(const RayBatch& batch, const TileSettings& settings);
std::uint32_t tile_count(const RayBatch& batch, const TileSettings& settings);
std::size_t tile_list_bytes(const TraceScene& scene, const RayBatch& batch, const TileSettings& settings);
/// Returns the size of TileBuffers::rest, bytes.
std::size_t rest_bytes(const RayBatch& batch, const TileSettings& settings);
/// Returns the defines of shaders/lib/tile_list.glsl for such lists.
gpu::Defines tile_defines(const TraceScene& scene, const RayBatch& batch, const TileSettings& settings);

// The following steps are called by passes that have declared the batch:
//     batch.rays           texture_read
//     list, header         storage_read and indirect_read, if the batch has them
//     frame_constants      uniform_read, if the scene is alpha tested

/// Updates the lists; a list whose shaft still contains the rays is kept. Adds the number of lists made to the first
/// word of `culled`. Accesses: lists and blockers storage_read_write.
void cull_tiles(graph::Resources& resources, const TraceScene& scene, const RayBatch& batch, const TileBuffers& tiles,
                bool any_hit, const gpu::Buffer& culled);
/// Searches the leaves of the lists. Accesses: lists texture_read; blockers and results storage_read_write; rest and
/// rest_header storage_read_write, with any content.
void search_tiles(graph::Resources& resources, const TraceScene& scene, const RayBatch& batch, const TileBuffers& tiles,
                  graph::BufferHandle results, bool any_hit);
/// Searches below the other entries, after search_tiles(). Accesses: rest storage_read; rest_header storage_read and
/// indirect_read; others as in search_tiles().
void search_rest(graph::Resources& resources, const TraceScene& scene, const RayBatch& batch, const TileBuffers& tiles,
                 graph::BufferHandle results, bool any_hit);

/// Counts rays and, if `lists` (texture_read) are given and up to date, list entries, for statistics. Waits for the
/// GPU.
shared::BatchCounts count_batch(graph::Resources& resources, const TraceScene& scene, const RayBatch& batch,
                                const TileSettings& settings, graph::BufferHandle lists);

}  // namespace halflight::rays
