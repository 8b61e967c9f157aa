// Searches the rest of the lists of shaders/trace_tiles.comp: the entries that are no leaves, or everything again.
#include "shaders/tile_search.glsl"

layout(local_size_x = 64) in;

void main() {
    if (gl_GlobalInvocationID.x >= rest_head.list.count) return;
    RestEntry entry = rest[gl_GlobalInvocationID.x];
    bool again = (entry.slot & kSearchAgain) != 0u;
    uint slot = entry.slot & ~kSearchAgain;
    uint tile = slot / uint(kTileRays);
    TileRay r = tile_ray(slot);
    BvhHead head = bvh_head(0u);
    BoxRay box = box_ray(r.ray.origin, r.ray.direction, head.base, head.cell, head.slack);
    Hit known = no_hit();
    if (!kAnyHit && !again) known = hits[r.path];
    int entries = 0;
    EntryMask others = again ? kNoEntries : entry.others;
    do {  // closest-hit rays take far entries first
        int i = max(first_entry(others), 0);
        TileEntry e = load_entry(tile, i);
        const int outer = kTwoLevel ? kInstanceBox : kEntryBox;
        EntryHit h = intersect_entry(box, box_lower(e, outer), box_upper(e, outer), r.ray.t_min, r.ray.t_max);
        bool inside = kTwoLevel && box_word(e, kInstanceBox) != kNoInstance && is_inner_node(entry_reference(e));
        if (any_entry(others) && (!kTwoLevel || h.met)) {
            if (inside) {
                stack[entries] = entry_reference(e);
                stack_near[entries] = kBvhFar;
                ++entries;
            }
            stack[entries] = inside ? kStackInstance | box_word(e, kInstanceBox) : entry_reference(e);
            stack_near[entries] = h.near;
            ++entries;
        }
        others &= ~entry_bit(i);
    } while (any_entry(others));
    if (again) {
        stack[0] = top_root();
        stack_near[0] = floatBitsToInt(r.ray.t_min);
        entries = 1;
    }
    store_answer(r.path, traverse_from(r.ray, entries, known, alpha_sampler(r.path), kAnyHit));
}
