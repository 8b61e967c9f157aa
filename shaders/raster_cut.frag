// What rays of this tile can meet of some leaves, before they end: a list of nodes with some of their children each. A child
// is cut further where it is large for the shaft's width there, as long as the list has room for what that may add.
#include "shaders/trace_scene.glsl"
#include "shaders/shared/word.h"
#include "shaders/lib/bvh.glsl"
#include "shaders/lib/raster_boxes.glsl"

layout(early_fragment_tests) in;  // lists of what is dropped are not read

layout(binding = UNIT_RASTER_DEPTH) uniform sampler2D tile_depth;
layout(std430, binding = 5) writeonly buffer Lists { uint lists[]; };

const float kLarge = 4.0;  // times the shaft's width; from 2 to 16 make little difference

flat in uint block_candidates;
layout(location = 0) out uint list_size;

struct Children {
    vec4 begin;    // in parts of the shaft's length; more than 1: not met
    vec4 extent;   // greatest edge, world
    uvec4 reference;
};

Children children_of(ShaftTest shaft, vec3 cell, uint node) {
    Children c;
#ifdef HALFLIGHT_NODES_FLOAT
    int texel = int(node) * kBvhFloatTexels;
    vec4 lower_x = texelFetch(trace_nodes, texel), upper_x = texelFetch(trace_nodes, texel + 1);
    vec4 lower_y = texelFetch(trace_nodes, texel + 2), upper_y = texelFetch(trace_nodes, texel + 3);
    vec4 lower_z = texelFetch(trace_nodes, texel + 4), upper_z = texelFetch(trace_nodes, texel + 5);
    c.reference = floatBitsToUint(texelFetch(trace_nodes, texel + 6));
#else
    int texel = int(node) * kBvhGridTexels;
    uvec4 x = texelFetch(trace_nodes, texel), y = texelFetch(trace_nodes, texel + 1), z = texelFetch(trace_nodes, texel + 2);
    vec4 lower_x = cells_of(x.xy), lower_y = cells_of(y.xy), lower_z = cells_of(z.xy);
    vec4 upper_x = cells_of(x.zw), upper_y = cells_of(y.zw), upper_z = cells_of(z.zw);
    c.reference = texelFetch(trace_nodes, texel + 3);
#endif
    c.begin = shaft_begins(shaft, lower_x, lower_y, lower_z, upper_x, upper_y, upper_z);
    c.begin = mix(c.begin, vec4(2.0), equal(c.reference, uvec4(kBvhNoChild)));
    c.extent = max((upper_x - lower_x) * cell.x, max((upper_y - lower_y) * cell.y, (upper_z - lower_z) * cell.z));
    return c;
}

// Slots from far to near, two bits each, the first one lowest.
uint far_to_near(vec4 begin) {
    uvec4 k = (floatBitsToUint(begin) & ~3u) | uvec4(0u, 1u, 2u, 3u);
    k = uvec4(max(k.x, k.y), min(k.x, k.y), max(k.z, k.w), min(k.z, k.w));
    k = uvec4(max(k.x, k.z), max(k.y, k.w), min(k.x, k.z), min(k.y, k.w));
    k = uvec4(k.x, max(k.y, k.z), min(k.y, k.z), k.w) & 3u;
    return k.x | k.y << 2 | k.z << 4 | k.w << 6;
}

uint bits_of(bvec4 v) { return uint(v.x) | uint(v.y) << 1 | uint(v.z) << 2 | uint(v.w) << 3; }

void main() {
    uvec2 texel = uvec2(gl_FragCoord.xy);
    uint tile = tile_of_texel(texel);
    Shaft shaft = fetch_shaft(tile);
    ShaftTest test = shaft_test(shaft, hull, slack);
    float reach = reach_of(texelFetch(tile_depth, ivec2(texel), 0).x);
    BvhHead head = bvh_head(0u);
#ifdef HALFLIGHT_NODES_FLOAT
    vec3 cell = vec3(1.0);
    ShaftTest inside = test;
#else
    vec3 cell = head.cell;
    ShaftTest inside = scaled_shaft(test, head.base, cell);
#endif
    float from_width = greatest_of(shaft.from_upper - shaft.from_lower);
    float to_width = greatest_of(shaft.to_upper - shaft.to_lower);

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
            Children c = children_of(inside, cell, node);
            bvec4 meets = lessThanEqual(c.begin, vec4(1.0));
            meets = bvec4(uvec4(meets) & uvec4(lessThanEqual(c.begin * test.least_t, vec4(reach))));
            vec4 width = mix(vec4(from_width), vec4(to_width), min(c.begin, vec4(1.0)));
            bvec4 large = greaterThan(c.extent, kLarge * width);
            bvec4 inner = lessThan(c.reference, uvec4(kBvhTag | kBvhLeaf));
            uint slots = (entry >> kRasterSlotShift) & bits_of(meets);
            uint cut = slots & bits_of(large) & bits_of(inner);
            uint count = uint(bitCount(cut));
            if (used + waits + count + 1u + others > kRasterList) cut = 0u;
            slots &= ~cut;
            if (slots != 0u) lists[first + used++] = node | slots << kRasterSlotShift;
            uint order = far_to_near(c.begin);
            for (uint i = 0u; i < 4u; ++i, order >>= 2) {
                uint slot = order & 3u;
                if ((cut >> slot & 1u) != 0u) {
                    waiting[waits++] = (c.reference[slot] & kBvhIndexMask) | 15u << kRasterSlotShift;
                }
            }
        }
    }
    if (used == 0u) discard;
    list_size = used;
}
