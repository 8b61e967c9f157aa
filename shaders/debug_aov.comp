// Stores the cost of tracing per pixel. HALFLIGHT_COUNT counts nodes; HALFLIGHT_TILE_LISTS reads the lists of shadow
// rays; HALFLIGHT_RESIDENCY finds the pages of surfaces, in scenes that are loaded in pages.
#include "shaders/shared/aov_record.h"
#include "shaders/shared/frame_block.h"
#include "shaders/shared/ray_structs.h"
#include "shaders/trace_scene.glsl"
#include "shaders/lib/alpha_sampler.glsl"
#include "shaders/lib/tile_list.glsl"
#include "shaders/lib/traverse.glsl"
#include "shaders/lib/residency.glsl"

const bool kTileLists = HALFLIGHT_TILE_LISTS != 0;
const bool kResidency = HALFLIGHT_RESIDENCY != 0;

layout(local_size_x = 64) in;

layout(std140) uniform FrameBlock { Frame frame; };
layout(std430) readonly buffer Rays { Ray rays[]; };
OPTIONAL(HALFLIGHT_RESIDENCY) layout(std430) readonly buffer Hits { Hit hits[]; };
layout(std430) writeonly buffer Records { DebugRecord records[]; };

void main() {
    uint path = gl_GlobalInvocationID.x;
    DebugRecord record = DebugRecord(0u, 0u, 0u, 0u, 0u);
    if (kCountsNodes) {
        traverse(rays[path], alpha_sampler_of_path(frame, path, 0u), false);
        record.nodes = nodes_visited;
    }
    if (kTileLists) {
        TileCounts list = load_counts(path / uint(max(kTileRays, 1)));
        record.leaves = uint(list.leaves);
        record.others = uint(list.others);
    }
    if (kResidency && hits[path].triangle != kMiss) {
        Ray ray = rays[path];
        BvhHead head = bvh_head(top);
        float error = position_error(ray.origin, head.base, head.cell, head.slack);
        Subtree subtree = subtree_around(ray.origin + hits[path].t * ray.direction, error);
        record.subtree = subtree.number;
        record.resident = uint(subtree.resident);
    }
    records[path] = record;
}
