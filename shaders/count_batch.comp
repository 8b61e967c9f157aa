// Counts the rays of a batch and, with HALFLIGHT_TILE_LISTS, its list entries, for statistics. Each invocation has one
// tile.
#include "shaders/shared/ray_structs.h"
#include "shaders/lib/tile_list.glsl"
#include "shaders/lib/tile_rays.glsl"

layout(local_size_x = 64) in;

layout(std430) buffer Counts { BatchCounts counts; };

void main() {
    uint tile = gl_GlobalInvocationID.x;
    uint live = 0u;
    uint k = 0u;
    do {
        live += tile_ray(tile * uint(kTileRays) + k).live ? 1u : 0u;
        ++k;
    } while (k < uint(kTileRays));
    if (live == 0u) return;
    atomicAdd(counts.rays, live);
    atomicAdd(counts.tiles, 1u);
    if (HALFLIGHT_TILE_LISTS == 0) return;
    TileCounts list = load_counts(tile);
    atomicAdd(counts.entries, uint(list.leaves + list.others));
    atomicAdd(counts.leaves, uint(list.leaves));
    atomicMax(counts.longest, uint(list.leaves + list.others));
}
