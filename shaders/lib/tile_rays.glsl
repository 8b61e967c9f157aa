// The rays of a batch by slot: consecutive slots are a tile. This file binds the batch.
//
// Variants: HALFLIGHT_LIST (slots are those of a list of paths; else slots are paths), HALFLIGHT_ENDS (rays end where
// the buffer Ends says, at the latest).
#include "shaders/lib/batch_rays.glsl"

#if HALFLIGHT_LIST
layout(std430) readonly buffer List { uint list[]; };
layout(std430) readonly buffer Header { ListHeader header; };
#else
uniform uint capacity;  // number of rays
#endif
#if HALFLIGHT_ENDS
layout(std430) readonly buffer Ends { float ends[]; };
#endif

struct TileRay {
    Ray ray;
    uint path;
    bool listed;  // true: the slot exists
    bool live;    // true: the slot exists and its ray must be traced
};

TileRay tile_ray(uint slot) {
#if HALFLIGHT_LIST
    bool listed = slot < header.count;
    uint entry = list[listed ? slot : 0u];
    uint path = listed ? entry : 0u;  // an empty list has no first entry
#else
    bool listed = slot < capacity;
    uint path = min(slot, capacity - 1u);
#endif
    Ray ray = load_ray(path);
#if HALFLIGHT_ENDS
    ray.t_max = min(ray.t_max, ends[path]);
#endif
    return TileRay(ray, path, listed, listed && ray.t_max >= ray.t_min);
}
