// Lists nodes below some leaves, each with some of its children, that rays of this tile can meet before they end. A
// child that is large for the shaft's width there is cut further, as long as the list has room for the new entries.
#include "shaders/trace_scene.glsl"
#include "shaders/shared/word.h"
#include "shaders/lib/bvh.glsl"
#include "shaders/lib/node_boxes.glsl"
#include "shaders/lib/raster_boxes.glsl"

layout(early_fragment_tests) in;  // lists of dropped fragments are never read

uniform sampler2D tile_depth;  // maximum reach of the tile's rays
layout(std430) writeonly buffer Lists { uint lists[]; };

const float kLarge = 4.0;  // size above which a child is cut, in shaft widths; values from 2 to 16 differ little

flat in uint block_candidates;
layout(location = 0) out uint list_size;

// Returns the slots from far to near, two bits each, the first one lowest.
uint far_to_near(vec4 begin) {
    uvec4 k = (floatBitsToUint(begin) & ~3u) | uvec4(0u, 1u, 2u, 3u);
    k = uvec4(max(k.x, k.y), min(k.x, k.y), max(k.z, k.w), min(k.z, k.w));
    k = uvec4(max(k.x, k.z), max(k.y, k.w), min(k.x, k.z), min(k.y, k.w));
    k = uvec4(k.x, max(k.y, k.z), min(k.y, k.z), k.w) & 3u;
    return k.x | k.y << 2 | k.z << 4 | k.w << 6;
}

void main() {
    uvec2 texel = uvec2(gl_FragCoord.xy);
    uint tile = tile_of_texel(texel);
    TimedShaft shaft = fetch_shaft(tile);
    TimedTest test = shaft_test(shaft, hull, slack);
    float reach = reach_of(texelFetch(tile_depth, ivec2(texel), 0).x);
    BvhHead head = bvh_head(0u);
    vec3 cell = kFloatNodes ? vec3(1.0) : head.cell;
    ShaftTest inside = test.test;
    if (!kFloatNodes) inside = scaled_shaft(test.test, head.base, cell);
    float from_width = greatest_of(shaft.rays.origin_upper - shaft.rays.origin_lower);
    float to_width = greatest_of(shaft.rays.end_upper - shaft.rays.end_lower);

    uint waiting[kRasterList];  // nodes to be cut, as entries
    uint first = tile * kRasterList;
    uint used = 0u, waits = 0u;
    for (uint left = block_candidates; left != 0u; left &= left - 1u) {
        uint candidate = uint(findLSB(left));
        float near = candidate_near(test, candidate);
        if (near >= 0.0 && near <= reach) {
            int box = box_of_candidate(candidate) * 2;
            waiting[0] = word_of_float(texelFetch(boxes, box).w) |
                         word_of_float(texelFetch(boxes, box + 1).w) << kRasterSlotShift;
            waits = 1u;
        }
        uint others = uint(bitCount(left)) - 1u;
        while (waits > 0u) {
            uint entry = waiting[--waits];
            uint node = entry & kBvhIndexMask;
            NodeBoxes n = load_node(node);
            ShaftInterval i = shaft_interval(inside, n.lower, n.upper);
            bvec4 meets = bvec4(uvec4(lessThanEqual(i.enter, i.leave)) & uvec4(notEqual(n.reference, uvec4(kBvhNoChild))) &
                                uvec4(lessThanEqual(i.enter * test.least_t, vec4(reach))));
            vec4 extent = max((n.upper[0] - n.lower[0]) * cell.x,
                              max((n.upper[1] - n.lower[1]) * cell.y, (n.upper[2] - n.lower[2]) * cell.z));
            bvec4 large = greaterThan(extent, kLarge * mix(vec4(from_width), vec4(to_width), i.enter));
            bvec4 inner = lessThan(n.reference, uvec4(kBvhTag | kBvhLeaf));
            uint slots = (entry >> kRasterSlotShift) & mask_of(meets);
            uint cut = slots & mask_of(large) & mask_of(inner);
            uint count = uint(bitCount(cut));
            if (used + waits + count + 1u + others > kRasterList) cut = 0u;
            slots &= ~cut;
            if (slots != 0u) lists[first + used++] = node | slots << kRasterSlotShift;
            uint order = far_to_near(i.enter);
            for (uint k = 0u; k < 4u; ++k, order >>= 2) {
                uint slot = order & 3u;
                if ((cut >> slot & 1u) != 0u) {
                    waiting[waits++] = (n.reference[slot] & kBvhIndexMask) | 15u << kRasterSlotShift;
                }
            }
        }
    }
    if (used == 0u) discard;
    list_size = used;
}
