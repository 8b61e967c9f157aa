// The compute back end of CHC+RT (Mattausch, Bittner, Jaspe, Gobbetti, Wimmer, Pajarola 2015, CHC+RT: Coherent
// Hierarchical Culling for Ray Tracing, Computer Graphics Forum 34(2)): a cut through the hierarchy per tile of rays
// (shaders/cull.comp), and kernels that search only there (shaders/trace_tiles.comp): first the leaves of the tile,
// then for the rays concerned what is below its other entries. Hits are those of the plain tracer, bit for bit. (A
// search that the driver would have cut short may come to its end here, being divided.)
#pragma once

#include <cstdint>

#include "engine/gpu/buffer.h"
#include "engine/graph/execute.h"
#include "engine/rays/rays.h"
#include "shaders/shared/tile_list.h"

namespace halflight::rays {

/// How many rays share a list, and how much it holds: matters to time and to nothing else.
struct TileSettings {
    std::uint32_t side = 8;       // pixels of a tile along x and y: 8 or 16
    std::uint32_t capacity = 32;  // entries of a list: 1 to kMostTileEntries of shaders/shared/tile_list.h
};

/// What the back end keeps of a batch.
struct TileBuffers {
    TileSettings settings;
    graph::BufferHandle lists;        // a record of shaders/shared/tile_list.h per tile; any content will do
    graph::BufferHandle blockers;     // of any_hit: TileBlockers per tile; any content will do
    graph::BufferHandle rest_header;  // RestHeader
    graph::BufferHandle rest;         // rest_bytes()
    bool counts = false;              // RestHeader::remembered is wanted
};

/// Rays of a tile: side^2; 16 consecutive ones where paths have several, which connect the receivers of a group with
/// one point, or those of smaller groups with a few.
std::uint32_t tile_rays(const RayBatch& batch, const TileSettings& settings);
std::uint32_t tile_count(const RayBatch& batch, const TileSettings& settings);
std::size_t tile_list_bytes(const TraceScene& scene, const RayBatch& batch, const TileSettings& settings);
/// Of TileBuffers::rest.
std::size_t rest_bytes(const RayBatch& batch, const TileSettings& settings);
/// Variant of shaders/lib/tile_list.glsl that reads such lists.
gpu::Defines tile_defines(const TraceScene& scene, const RayBatch& batch, const TileSettings& settings);

/// The steps, to be called by passes that have declared: batch.rays as texture_read, list and header (where the batch
/// has them) as storage_read and indirect_read, frame_constants (where the scene is alpha tested) as uniform_read.
///
/// Brings the lists up to date; those whose shaft still holds the rays stay. culled: its first word is raised by the
/// number of lists made. lists and blockers: storage_read_write.
void cull_tiles(graph::Resources& resources, const TraceScene& scene, const RayBatch& batch, const TileBuffers& tiles,
                bool any_hit, const gpu::Buffer& culled);
/// lists: texture_read. blockers and results: storage_read_write. rest and rest_header: storage_read_write, of any
/// content.
void search_tiles(graph::Resources& resources, const TraceScene& scene, const RayBatch& batch, const TileBuffers& tiles,
                  graph::BufferHandle results, bool any_hit);
/// After search_tiles(). rest: storage_read. rest_header: storage_read and indirect_read. The others as there.
void search_rest(graph::Resources& resources, const TraceScene& scene, const RayBatch& batch, const TileBuffers& tiles,
                 graph::BufferHandle results, bool any_hit);

/// For statistics: what there is in a batch, and in its lists (texture_read) where they are given and up to date.
/// Waits.
shared::BatchCounts count_batch(graph::Resources& resources, const TraceScene& scene, const RayBatch& batch,
                                const TileSettings& settings, graph::BufferHandle lists);

}  // namespace halflight::rays
