// The rays of a batch by slot: consecutive slots are a tile. This file binds the batch.
//
// Variants: HALFLIGHT_LIST (slots are those of a list of paths; else slots are paths), HALFLIGHT_ENDS (rays end where
// the buffer Ends says, at the latest).
#include "shaders/lib/batch_paths.glsl"
#include "shaders/lib/batch_rays.glsl"

OPTIONAL(HALFLIGHT_ENDS) layout(std430) readonly buffer Ends { float ends[]; };

struct TileRay {
    Ray ray;
    uint path;
    bool listed;  // true: the slot exists
    bool live;    // true: the slot exists and its ray must be traced
};

TileRay tile_ray(uint slot) {
    bool listed = slot < entry_count();
    // An empty list has no first entry.
    uint entry = kListed ? path_of(listed ? slot : 0u) : min(slot, capacity - 1u);
    uint path = !kListed || listed ? entry : 0u;
    Ray ray = load_ray(path);
    if (HALFLIGHT_ENDS != 0) ray.t_max = min(ray.t_max, ends[path]);
    return TileRay(ray, path, listed, listed && ray.t_max >= ray.t_min);
}
