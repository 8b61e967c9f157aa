// Makes a list for each tile of a batch: an adaptive cut through the hierarchy by the shaft of the tile's rays. Each
// invocation has one tile.
//
// A node is refined until it is smaller than `stop` times the width of the shaft where it enters, or until the list is
// full. Nodes that are left then go into the list unrefined, so that nothing is dropped. Instances are entered like
// nodes. For closest hits, near nodes are refined first, as they often hide those behind. For any hits, all parts of
// the shaft matter equally. Nodes that have waited longest are refined first, far ones before near ones, so that the
// list becomes evenly fine.
//
// The list of an earlier run is kept if its checksum is right and its shaft still contains the rays. A new shaft
// includes the earlier one if the two are similar, and is widened. The shafts of a still camera therefore soon contain
// all later rays.
#include "shaders/shared/ray_structs.h"
#include "shaders/trace_scene.glsl"
#include "shaders/lib/bvh.glsl"
#include "shaders/lib/chord.glsl"
#include "shaders/lib/block_boxes.glsl"
#include "shaders/lib/node_boxes.glsl"
#include "shaders/lib/tile_list.glsl"  // lists of earlier runs, in the same buffer as `lists`
#include "shaders/lib/tile_rays.glsl"

layout(local_size_x = 64) in;

layout(std430) writeonly buffer Lists { uvec4 lists[]; };
layout(std430) buffer Counts { uint tiles_culled; };
const bool kAnyHit = HALFLIGHT_ANY_HIT != 0;
OPTIONAL(HALFLIGHT_ANY_HIT) layout(std430) buffer Blockers { TileBlockers blockers_of[]; };

uniform uint tiles;
uniform float stop;
uniform uint seed;  // seed of checksums, unique per scene

// Maximum size of the union of two shafts over the later one, for two samples of the same pixels.
const float kMuchTheSame = 1.5;

uint checksum(uint sum, uvec4 words) {
    sum = (sum ^ words.x) * 0x9e3779b1u;
    sum = (sum ^ words.y ^ (sum >> 15)) * 0x85ebca77u;
    sum = (sum ^ words.z ^ (sum >> 13)) * 0xc2b2ae3du;
    return (sum ^ words.w ^ (sum >> 16)) * 0x27d4eb2fu;
}

uint checksum(uint sum, TileEntry e) {
    for (int i = 0; i < kEntryTexels; ++i) sum = checksum(sum, e.texels[i]);
    return sum;
}

// Returns the checksum of a tile record. sums.x covers its leaf entries, sums.y its other entries.
uint checksum(uvec2 sums, Shaft s, uint counts) {
    uint sum = checksum(seed, uvec4(sums, counts, 0u));
    sum = checksum(sum, uvec4(floatBitsToUint(s.origin_lower), floatBitsToUint(s.end_upper.x)));
    sum = checksum(sum, uvec4(floatBitsToUint(s.origin_upper), floatBitsToUint(s.end_upper.y)));
    return checksum(sum, uvec4(floatBitsToUint(s.end_lower), floatBitsToUint(s.end_upper.z)));
}

// Returns the bounds of all rays of the tile. Without a ray, lower corners are +inf.
Shaft bounds_of(ShaftSpace space, uint tile) {
    const float inf = uintBitsToFloat(0x7f800000u);
    Shaft s = Shaft(vec3(inf), vec3(-inf), vec3(inf), vec3(-inf));
    uint k = 0u;
    do {
        TileRay r = tile_ray(tile * uint(kTileRays) + k);
        Chord c = chord_of(space, r.ray.origin, r.ray.direction, r.ray.t_max);
        s.origin_lower = r.live ? min(s.origin_lower, c.origin) : s.origin_lower;
        s.origin_upper = r.live ? max(s.origin_upper, c.origin) : s.origin_upper;
        s.end_lower = r.live ? min(s.end_lower, c.end) : s.end_lower;
        s.end_upper = r.live ? max(s.end_upper, c.end) : s.end_upper;
        ++k;
    } while (k < uint(kTileRays));
    return s;
}

float size(Shaft s) {
    vec3 w = (s.origin_upper - s.origin_lower) + (s.end_upper - s.end_lower);
    return w.x + w.y + w.z;
}

// Widens a shaft by a sixteenth on all sides. In one or two of a hundred tiles, the next 64 rays lie that far beyond
// the extremes of the first 64 ((15/16)^64 for uniform rays).
Shaft widened(Shaft s) {
    vec3 origin = (s.origin_upper - s.origin_lower) * 0.0625;
    vec3 end = (s.end_upper - s.end_lower) * 0.0625;
    return Shaft(s.origin_lower - origin, s.origin_upper + origin, s.end_lower - end, s.end_upper + end);
}

// Shaft of the record of an earlier run; its values are arbitrary if there is no valid record.
struct Earlier {
    Shaft shaft;
    uint counts;
    uint sum;
};

Earlier load_earlier(uint tile) {
    uvec4 words[kTileHeaderTexels];
    for (int i = 0; i < kTileHeaderTexels; ++i) words[i] = texelFetch(tile_lists, int(tile) * kTileRecord + i);
    return Earlier(Shaft(uintBitsToFloat(words[0].xyz), uintBitsToFloat(words[1].xyz), uintBitsToFloat(words[2].xyz),
                         uintBitsToFloat(words[3].xyz)),
                   words[1].w, words[0].w);
}

// Returns whether this kernel has written the record. If `asked` is false, nothing is read.
bool intact(Earlier e, uint tile, bool asked) {
    TileCounts counts = tile_counts(e.counts);
    bool possible = asked && counts.leaves + counts.others <= kTileEntries;
    int leaves = possible ? counts.leaves : 0;
    int entries = possible ? leaves + counts.others : 0;
    uvec2 sums = uvec2(seed);
    int i = 0;
    do {
        bool leaf = i < leaves;
        TileEntry entry = load_entry(tile, leaf ? i : kTileEntries - 1 - (i - leaves));
        uint sum = checksum(leaf ? sums.x : sums.y, entry);
        if (i < entries) {
            sums.x = leaf ? sum : sums.x;
            sums.y = leaf ? sums.y : sum;
        }
        ++i;
    } while (i < entries);
    return possible && checksum(sums, e.shaft, e.counts) == e.sum;
}

float pick(vec4 v, int i) {
    float low = (i & 1) == 0 ? v.x : v.y;
    float high = (i & 1) == 0 ? v.z : v.w;
    return i < 2 ? low : high;
}

void put_box(inout TileEntry e, const int box, vec3 lower, vec3 upper, uint word) {
    if (kFloatNodes) {
        e.texels[box] = uvec4(floatBitsToUint(lower), word);
        e.texels[box + kBoxTexels - 1] = uvec4(floatBitsToUint(upper), 0u);
    } else {
        e.texels[box] = uvec4(uvec3(ivec3(lower)) | (uvec3(ivec3(upper)) << 16), word);
    }
}

void put_child(inout TileEntry e, const int box, NodeBoxes n, int child, uint word) {
    put_box(e, box, vec3(pick(n.lower[0], child), pick(n.lower[1], child), pick(n.lower[2], child)),
            vec3(pick(n.upper[0], child), pick(n.upper[1], child), pick(n.upper[2], child)), word);
}

uint child_reference(NodeBoxes n, int child) {
    return floatBitsToUint(pick(uintBitsToFloat(n.reference), child));
}

TileEntry root_entry(ShaftSpace space) {
    TileEntry e;
    put_box(e, kEntryBox, space.lower, space.upper, kBvhTag | 1u);
    if (kTwoLevel) {
        put_box(e, kInstanceBox, space.lower, space.upper, kNoInstance);
        put_box(e, kBlockBox, space.lower, space.upper, 0u);
    }
    return e;
}

// Returns the boxes of a node within an instance, in the units of the hierarchy over the instances.
NodeBoxes from_block(ShaftSpace space, NodeBoxes n, uint instance, uint head, vec3 margin) {
    NodeBoxes around;
    around.reference = n.reference;
    boxes_around(space, bvh_head(head), instance, margin, n.lower, n.upper, around.lower, around.upper);
    return around;
}

// Returns a set of children, as bits: inner ones that are not yet small against the shaft where it enters.
uint children_to_refine(ShaftSpace space, NodeBoxes n, vec3 width_0, vec3 width_1, vec4 enter) {
    vec4 size = vec4(0.0);
    vec4 width = vec4(0.0);
    for (int a = 0; a < 3; ++a) {
        size = max(size, (n.upper[a] - n.lower[a]) * space.cell[a]);
        width = max(width, width_0[a] + enter * (width_1[a] - width_0[a]));
    }
    bvec4 coarse = greaterThanEqual(size, stop * width);
    bvec4 inner = equal(n.reference & kBvhLeaf, uvec4(0u));  // nodes and instances
    return mask_of(coarse) & mask_of(inner);
}

// Sorts the keys of four children. The lowest two bits of a key are the child.
ivec4 ascending(ivec4 k) {
    k = ivec4(min(k.xz, k.yw), max(k.xz, k.yw)).xzyw;
    k = ivec4(min(k.xy, k.zw), max(k.xy, k.zw));
    return ivec4(k.x, min(k.y, k.z), max(k.y, k.z), k.w);
}

const int kWaiting = kTileEntries > kTileMaskBits ? 2 * kTileMaskBits : kTileMaskBits;  // a power of two >= kTileEntries

int waiting_texel(int place) { return (place & (kWaiting - 1)) * kNodeTexels; }

void main() {
    uint tile = min(gl_GlobalInvocationID.x, tiles - 1u);  // invocations beyond the last tile read that one
    BvhHead head = bvh_head(0u);
    ShaftSpace space = shaft_space(head);
    Shaft shaft = bounds_of(space, tile);
    // The bounds of a tile without rays are inverted. Its list is never read.
    bool asked = gl_GlobalInvocationID.x < tiles && shaft.origin_lower.x <= shaft.origin_upper.x;
    // In lists, a place belongs to another pixel in the next run, so nothing of an earlier run can be kept.
    bool stale = asked;
    if (!kListed) {
        Earlier earlier = load_earlier(tile);
        stale = asked && !intact(earlier, tile, shaft_contains(earlier.shaft, shaft));
        Shaft both = shaft_union(shaft, earlier.shaft);  // invalid records give larger or NaN shafts, which are rejected
        if (size(both) <= kMuchTheSame * size(shaft)) shaft = widened(both);
    }

    ShaftTest test = shaft_test(space, shaft);
    vec3 width_0 = (shaft.origin_upper - shaft.origin_lower) * space.cell;
    vec3 width_1 = (shaft.end_upper - shaft.end_lower) * space.cell;
    uvec4 waiting[kWaiting * kNodeTexels];  // ring buffer of nodes, at most the free entries of the list
    int first_waiting = 0;
    int waiting_count = 0;
    int leaves = 0;
    int others = 0;
    vec3 margin = block_margin(space, shaft);
    uvec2 sums = uvec2(seed);
    TileBlockers blockers = TileBlockers(0u, kAnyHit ? blockers_of[tile].latest : 0u);
    bool more = stale;
    TileEntry entry = root_entry(space);
    do {
        if (more) {
            uint instance = kTwoLevel ? box_word(entry, kInstanceBox) : kNoInstance;
            bool inside = kTwoLevel && instance != kNoInstance;
            uint block = inside ? block_head(instance) : 0u;
            bool enters = kTwoLevel && entry_reference(entry) >= (kBvhTag | kBvhInstance);
            NodeBoxes own = load_node(enters ? block + 1u : entry_reference(entry));
            NodeBoxes n = own;
            if (inside) n = from_block(space, own, instance, block, margin);
            ShaftInterval i = shaft_interval(test, n.lower, n.upper);
            // The box of a missing child is empty, yet a wide shaft meets it.
            bvec4 met = bvec4(uvec4(lessThanEqual(i.enter, i.leave)) & uvec4(notEqual(n.reference, uvec4(kBvhNoChild))));
            uint refine = children_to_refine(space, n, width_0, width_1, i.enter);
            ivec4 key = ascending(mix(ivec4(kBvhFar), floatBitsToInt(i.enter) & ~3, met) | ivec4(0, 1, 2, 3));
            // Waiting nodes have their place in the list. Without room for the children, the node itself takes one.
            int left = bitCount(mask_of(met));
            bool full = leaves + others + waiting_count + left > kTileEntries;
            uint goes_on = full ? 0u : refine & mask_of(met);
            left = full ? 1 : left;
            int place = waiting_count + bitCount(goes_on);  // near nodes come last
            waiting_count = place;
            do {
                if (left > 0) {
                    int c = key.x & 3;
                    key = key.yzwx;
                    --left;
                    TileEntry child;
                    uint reference = child_reference(n, c);
                    put_child(child, kEntryBox, n, c, reference);
                    if (kTwoLevel) {
                        bool is_instance = reference >= (kBvhTag | kBvhInstance);
                        put_child(child, kInstanceBox, n, c, is_instance ? reference & kBvhIndexMask : kNoInstance);
                        for (int t = kInstanceBox; t < kBlockBox; ++t) {
                            child.texels[t] = inside ? entry.texels[t] : child.texels[t];
                        }
                        put_child(child, kBlockBox, own, c, block);
                    }
                    if (full) child = entry;
                    bool leaf = is_leaf(entry_reference(child));
                    if (((goes_on >> c) & 1u) != 0u) {
                        --place;
                        int texel = waiting_texel(first_waiting + place);
                        for (int t = 0; t < kNodeTexels; ++t) waiting[texel + t] = child.texels[t];
                    } else {
                        int texel = entry_texel(tile, leaf ? leaves : kTileEntries - 1 - others);
                        for (int t = 0; t < kEntryTexels; ++t) lists[texel + t] = child.texels[t];
                        uint sum = checksum(leaf ? sums.x : sums.y, child);
                        sums = leaf ? uvec2(sum, sums.y) : uvec2(sums.x, sum);
                        // A block's leaf may occur several times if there are instances.
                        if (kAnyHit && leaf && reference == blockers.latest)
                            blockers.entries |= first_word(entry_bit(leaves));
                        leaves += leaf ? 1 : 0;
                        others += leaf ? 0 : 1;
                    }
                }
            } while (left > 0);
            more = waiting_count > 0;
            if (more) {
                --waiting_count;
                int texel = waiting_texel(kAnyHit ? first_waiting : waiting_count);
                if (kAnyHit) ++first_waiting;
                for (int t = 0; t < kNodeTexels; ++t) entry.texels[t] = waiting[texel + t];
            }
        }
    } while (more);

    // The driver has cut the search short: llvmpipe ends loops at 65535 iterations.
    if (more) {
        TileEntry root = root_entry(space);
        for (int t = 0; t < kEntryTexels; ++t) lists[entry_texel(tile, kTileEntries - 1) + t] = root.texels[t];
        leaves = 0;
        others = 1;
        sums = uvec2(seed, checksum(seed, root));
    }

    if (stale) {
        uint counts = uint(leaves | (others << 16));
        int record = int(tile) * kTileRecord;
        lists[record] = uvec4(floatBitsToUint(shaft.origin_lower), checksum(sums, shaft, counts));
        lists[record + 1] = uvec4(floatBitsToUint(shaft.origin_upper), counts);
        lists[record + 2] = uvec4(floatBitsToUint(shaft.end_lower), 0u);
        lists[record + 3] = uvec4(floatBitsToUint(shaft.end_upper), 0u);
        atomicAdd(tiles_culled, 1u);
        if (kAnyHit) blockers_of[tile] = blockers;
    }
}
