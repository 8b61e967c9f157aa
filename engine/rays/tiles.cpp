#include "engine/rays/tiles.h"

#include <epoxy/gl.h>

#include <algorithm>

#include "engine/core/interruption.h"
#include "engine/rays/batch_server.h"
#include "shaders/shared/ray_structs.h"
#include "shaders/shared/reuse_groups.h"
#include "shaders/shared/tile_list.h"

namespace halflight::rays {
namespace {

/// Returns the ratio of node size to shaft width below which nodes are not refined; found by experiment. Hits of
/// primary rays lie in their shaft, whereas the shafts of short rays are so wide that finer nodes only fill the list.
float stop_of(RayKind kind) {
    switch (kind) {
        case RayKind::primary:
            return 0.25f;
        case RayKind::shadow:
        case RayKind::sun:
            return 1.0f;
        case RayKind::occlusion:
            return 2.0f;
        default:
            return 0.5f;
    }
}

gpu::Defines search_defines(const TraceScene& scene, const RayBatch& batch, const TileBuffers& tiles, bool any_hit) {
    gpu::Defines defines = tile_defines(scene, batch, tiles.settings);
    if (batch.list) defines.set("HALFLIGHT_LIST");
    if (any_hit) defines.set("HALFLIGHT_ANY_HIT");
    return defines;
}

void bind_tiles(graph::Resources& r, const gpu::Program& program, const TraceScene& scene, const RayBatch& batch,
                const TileBuffers& tiles) {
    bind_batch(r, program, scene, batch);
    if (tiles.lists) program.bind_texture("tile_lists", r.buffer(tiles.lists), GL_RGBA32UI);
    if (!batch.list) program.set("capacity", batch.capacity);
}

void bind_search(graph::Resources& r, const gpu::Program& program, const TraceScene& scene, const RayBatch& batch,
                 const TileBuffers& tiles, graph::BufferHandle results, bool any_hit) {
    bind_tiles(r, program, scene, batch, tiles);
    program.bind_storage(any_hit ? "Occluded" : "Hits", r.buffer(results));
    program.bind_storage("Head", r.buffer(tiles.rest_header));
    program.bind_storage("Rest", r.buffer(tiles.rest));
}

}  // namespace

std::uint32_t tile_rays(const RayBatch& batch, const TileSettings& settings) {
    return batch.rays_of_path > 1 ? shared::kMostGroupSize : settings.side * settings.side;
}

std::uint32_t tile_count(const RayBatch& batch, const TileSettings& settings) {
    const std::uint32_t rays = tile_rays(batch, settings);
    return (batch.capacity + rays - 1) / rays;
}

std::size_t tile_list_bytes(const TraceScene& scene, const RayBatch& batch, const TileSettings& settings) {
    const bool grid = scene.statistics().node_format == NodeFormat::grid;
    const std::size_t box = grid ? shared::kTileBoxTexels : shared::kTileFloatBoxTexels;
    const std::size_t entry = box * (scene.statistics().two_level ? shared::kTileInstanceBoxes : shared::kTileBoxes);
    return tile_count(batch, settings) * (shared::kTileHeaderTexels + settings.capacity * entry) * sizeof(uvec4);
}

std::size_t rest_bytes(const RayBatch& batch, const TileSettings& settings) {
    // RestEntry of shaders/lib/tile_list.glsl: a word and a mask, aligned to the mask.
    const bool one_word = settings.capacity <= std::uint32_t{shared::kTileMaskBits};
    return batch.capacity * (one_word ? sizeof(uvec2) : sizeof(uvec4));
}

gpu::Defines tile_defines(const TraceScene& scene, const RayBatch& batch, const TileSettings& settings) {
    gpu::Defines defines = batch_defines(scene, batch);
    defines.set("HALFLIGHT_TILE_RAYS", tile_rays(batch, settings));
    defines.set("HALFLIGHT_TILE_ENTRIES", settings.capacity);
    return defines;
}

void cull_tiles(graph::Resources& r, const TraceScene& scene, const RayBatch& batch, const TileBuffers& tiles,
                bool any_hit, const gpu::Buffer& culled) {
    const std::uint32_t count = tile_count(batch, tiles.settings);
    gpu::Defines defines = search_defines(scene, batch, tiles, any_hit);
    if (tiles.ends) defines.set("HALFLIGHT_ENDS");
    const gpu::Program& program = r.programs().compute("shaders/cull.comp", defines);
    bind_tiles(r, program, scene, batch, tiles);
    if (tiles.ends) program.bind_storage("Ends", *tiles.ends);
    program.bind_storage("Lists", r.buffer(tiles.lists));
    program.bind_storage("Counts", culled);
    if (any_hit) program.bind_storage("Blockers", r.buffer(tiles.blockers));
    program.set("tiles", count);
    program.set("stop", tiles.finest ? 0.0f : stop_of(batch.kind));
    program.set("seed", scene.serial());
    program.dispatch((count + 63) / 64);
}

void search_tiles(graph::Resources& r, const TraceScene& scene, const RayBatch& batch, const TileBuffers& tiles,
                  graph::BufferHandle results, bool any_hit) {
    interruption_point();
    gpu::Defines defines = search_defines(scene, batch, tiles, any_hit);
    if (any_hit && tiles.counts) defines.set("HALFLIGHT_COUNT_REMEMBERED");
    const gpu::Program& program = r.programs().compute("shaders/trace_tiles.comp", defines);
    const shared::RestHeader empty{.list = {.groups_x = 0, .groups_y = 1, .groups_z = 1, .count = 0}, .remembered = 0};
    r.buffer(tiles.rest_header).write(0, sizeof(empty), &empty);
    bind_search(r, program, scene, batch, tiles, results, any_hit);
    if (any_hit) program.bind_storage("Blockers", r.buffer(tiles.blockers));
    program.set("tiles", tile_count(batch, tiles.settings));
    if (batch.list) {
        program.dispatch_indirect(r.buffer(batch.list_header), (batch.capacity + 63) / 64);
    } else {
        // The grid has two dimensions, because there may be more groups than the driver starts along one.
        const std::uint32_t group = std::min(tile_rays(batch, tiles.settings), 64u);
        const std::uint32_t count = (batch.capacity + group - 1) / group, row = std::min(count, 32768u);
        program.dispatch(row, (count + row - 1) / row);
    }
}

void search_rest(graph::Resources& r, const TraceScene& scene, const RayBatch& batch, const TileBuffers& tiles,
                 graph::BufferHandle results, bool any_hit) {
    const gpu::Program& program =
        r.programs().compute("shaders/trace_rest.comp", search_defines(scene, batch, tiles, any_hit));
    bind_search(r, program, scene, batch, tiles, results, any_hit);
    program.dispatch_indirect(r.buffer(tiles.rest_header), (batch.capacity + 63) / 64);
}

shared::BatchCounts count_batch(graph::Resources& r, const TraceScene& scene, const RayBatch& batch,
                                const TileSettings& settings, graph::BufferHandle lists) {
    TileBuffers tiles{};
    tiles.settings = settings;
    tiles.lists = lists;
    gpu::Defines defines = search_defines(scene, batch, tiles, false);
    if (lists) defines.set("HALFLIGHT_TILE_LISTS");
    const gpu::Program& program = r.programs().compute("shaders/count_batch.comp", defines);
    const gpu::Buffer counts("counts of a batch", sizeof(shared::BatchCounts));
    bind_tiles(r, program, scene, batch, tiles);
    program.bind_storage("Counts", counts);
    program.dispatch((tile_count(batch, settings) + 63) / 64);
    return counts.read<shared::BatchCounts>().front();
}

}  // namespace halflight::rays
