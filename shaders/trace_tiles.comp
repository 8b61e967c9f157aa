// Traces a batch of rays through their tiles' lists (shaders/cull.comp). A work group has 64 rays, or one tile.
//
// It searches the leaves of the tile's list. It puts the rays that must search other entries into a list for
// shaders/trace_rest.comp. Leaves need neither stack nor nodes, and software drivers pay for every loop of a kernel,
// entered or not.
//
// HALFLIGHT_COUNT_REMEMBERED: counts RestHeader::remembered.
#include "shaders/tile_search.glsl"

const int kGroupRays = min(kTileRays, 64);
layout(local_size_x = kGroupRays) in;

OPTIONAL(HALFLIGHT_ANY_HIT) layout(std430) buffer Blockers { TileBlockers blockers_of[]; };
uniform uint tiles;

// The boxes of the tile's entries. llvmpipe reads shared memory once for all rays if the address is constant and no
// branch is open. This makes 32 boxes cheaper than a few steps down a hierarchy.
shared vec3 entry_lower_corner[kTileEntries];
shared vec3 entry_upper_corner[kTileEntries];
shared uint entry_blockers;
shared uint group_remembered;

void share_entries(uint tile) {
    for (int k = 0; k < kTileEntries; k += kGroupRays) {
        int i = min(int(gl_LocalInvocationIndex) + k, kTileEntries - 1);
        TileEntry e = load_entry(tile, i);
        entry_lower_corner[i] = box_lower(e, kEntryBox);
        entry_upper_corner[i] = box_upper(e, kEntryBox);
    }
    if (kAnyHit && gl_LocalInvocationIndex == 0u) {
        entry_blockers = blockers_of[tile].entries;
        group_remembered = 0u;
    }
    barrier();
}

int entry_near[kTileEntries];

// Returns the set of entries that a ray meets. It has no loop, because no branch may be open.
#define MEET(i)                                                                                                     \
    if ((i) < kTileEntries) {                                                                                       \
        const int k = min(i, kTileEntries - 1);                                                                     \
        EntryHit h = intersect_entry(box, entry_lower_corner[k], entry_upper_corner[k], ray.t_min, t_exit);         \
        met |= h.met ? entry_bit(k) : kNoEntries;                                                                   \
        entry_near[k] = h.near;                                                                                     \
    }
#define MEET_4(i) MEET(i) MEET(i + 1) MEET(i + 2) MEET(i + 3)
#define MEET_16(i) MEET_4(i) MEET_4(i + 4) MEET_4(i + 8) MEET_4(i + 12)

EntryMask entries_met(BoxRay box, Ray ray, float t_exit) {
    EntryMask met = kNoEntries;
    MEET_16(0)
    MEET_16(16)
    if (kTileEntries > 32) {
        MEET_16(32)
        MEET_16(48)
    }
    return met;
}

// Returns the end of a ray for tests of boxes: `t`, or just below it for any-hit rays.
float exit_of(Ray ray, float t) { return kAnyHit ? uintBitsToFloat(floatBitsToUint(t) - 1u) : t; }

void put_into_rest(RestEntry entry) {
    uint place = atomicAdd(rest_head.list.count, 1u);
    if ((place & 63u) == 0u) atomicAdd(rest_head.list.groups_x, 1u);
    rest[place] = entry;
}

void main() {
    uint slot_of_ray =
        (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * uint(kGroupRays) + gl_LocalInvocationIndex;
    uint tile = min(slot_of_ray / uint(kTileRays), tiles - 1u);
    share_entries(tile);
    TileCounts counts = load_counts(tile);
    TileRay r = tile_ray(slot_of_ray);
    BvhHead head = bvh_head(0u);
    BoxRay box = box_ray(r.ray.origin, r.ray.direction, head.base, head.cell, head.slack);
    TriangleRay sheared = triangle_ray(r.ray.origin, r.ray.direction);
    EntryRay entry =
        entry_ray(sheared, r.ray.direction, position_error(r.ray.origin, head.base, head.cell, head.slack));
    EntryMask met = entries_met(box, r.ray, exit_of(r.ray, r.ray.t_max));
    met = r.live ? met : kNoEntries;
    EntryMask others = met & other_bits(counts);
    met &= leaf_bits(counts);

    Hit nearest = Hit(r.ray.t_max, 0.0, 0.0, 0u, 0u);
    bool found = false;
    bool again = false;  // true: an alpha test decides on the hit
    uint blockers = kAnyHit ? entry_blockers : 0u;
    TileBlockers blocker = TileBlockers(0u, 0u);
    int place = 0;
    int end = 0;
    int near = 0;
    do {
        int i = 0;
        bool enters = false;
        do {
            if (any_entry(met) && !enters) {
                EntryMask first = met & of_first_word(blockers);
                i = first_entry(any_entry(first) ? first : met);
                met &= ~entry_bit(i);
                near = entry_near[i];
                enters = kAnyHit || near <= floatBitsToInt(nearest.t);
            }
        } while (any_entry(met) && !enters);
        TileEntry e = load_entry(tile, i);
        uint reference = entry_reference(e);
        uint instance = 0u;
        if (kTwoLevel) {
            if (box_word(e, kInstanceBox) != kNoInstance) instance = box_word(e, kInstanceBox);
            uint block = box_word(e, kBlockBox);
            BvhHead block_head = bvh_head(block);
            Ray in_block = ray_in_block(r.ray, instance);
            sheared = triangle_ray(in_block.origin, in_block.direction);
            entry = entry_ray(sheared, in_block.direction,
                              position_error(in_block.origin, block_head.base, block_head.cell, block_head.slack));
            BoxRay block_box = box_ray(in_block.origin, in_block.direction, block_head.base, block_head.cell, block_head.slack);
            // Hits count from the entry of the ray into both boxes, as in a traversal.
            float t_exit = exit_of(r.ray, nearest.t);
            EntryHit by_instance =
                intersect_entry(box, box_lower(e, kInstanceBox), box_upper(e, kInstanceBox), r.ray.t_min, t_exit);
            EntryHit by_leaf =
                intersect_entry(block_box, box_lower(e, kBlockBox), box_upper(e, kBlockBox), r.ray.t_min, t_exit);
            near = max(by_instance.near, by_leaf.near);
            enters = enters && by_instance.met && by_leaf.met;
        }
        place = first_place(reference);
        end = enters ? place + places_in(reference) : place;
        do {
            if (place < end) {
                PlaceHit h =
                    intersect_place(sheared, entry, place, instance, r.ray.t_min, intBitsToFloat(near), nearest,
                                    kAnyHit);
                place = h.next;
                if (h.nearer) {
                    nearest = h.hit;
                    found = true;
                    if (kAlpha) again = h.alpha_tested;
                    blocker = TileBlockers(first_word(entry_bit(i)), reference);
                    if (kAnyHit || again) {
                        place = end;
                        met = kNoEntries;
                    }
                }
            }
        } while (place < end);
    } while (any_entry(met));

    if (HALFLIGHT_COUNT_REMEMBERED != 0) {
        if (found && !again && (blocker.entries & blockers) != 0u) atomicAdd(group_remembered, 1u);
        barrier();
        if (gl_LocalInvocationIndex == 0u) atomicAdd(rest_head.remembered, group_remembered);
    }
    // Two invocations may write at once. The lost write is found again in the next run.
    if (kAnyHit && (blocker.entries & ~blockers) != 0u)
        blockers_of[tile] = TileBlockers(blockers | blocker.entries, blocker.latest);

    // The other entries are tested again, because something nearer may have been found.
    int t_exit = floatBitsToInt(exit_of(r.ray, nearest.t));
    if (kAnyHit && found) others = kNoEntries;
    EntryMask left_of_others = kNoEntries;
    do {
        int i = max(first_entry(others), 0);
        left_of_others |= any_entry(others) && entry_near[i] <= t_exit ? entry_bit(i) : kNoEntries;
        others &= ~entry_bit(i);
    } while (any_entry(others));

    if (r.listed) {
        store_answer(r.path, found && !again ? nearest : no_hit());
        if (again || any_entry(left_of_others)) {
            put_into_rest(RestEntry(slot_of_ray | (again ? kSearchAgain : 0u), left_of_others));
        }
    }
}
