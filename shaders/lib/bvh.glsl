// One traversal step of a hierarchy. Needs shaders/trace_scene.glsl.
#include "shaders/lib/box.glsl"

const int kSlotTexels = max(HALFLIGHT_SLOT_TEXELS, 1);  // size of a slot of pages
uniform uint top;  // pages: texel of the head of the hierarchy over all pages, whose root follows

struct BvhHead {
    vec3 base;
    vec3 cell;
    float slack;
};

// Children of a node that a ray meets, sorted front to back.
struct BvhStep {
    ivec4 near;       // bits of floats, ascending; kBvhFar: no more children
    uvec4 reference;  // references of the children
};

const int kBvhFar = 0x7f800000;  // bits of +inf

BvhHead bvh_head(uint index) {
    int texel = kPageNodes ? int(index) : int(index) * (kFloatNodes ? kBvhFloatTexels : kBvhGridTexels);
    vec4 base = uintBitsToFloat(texelFetch(trace_nodes, texel));
    return BvhHead(base.xyz, uintBitsToFloat(texelFetch(trace_nodes, texel + 1).xyz), base.w);
}

// Unpacks four numbers of cells.
vec4 page_cells(uint word) {
    return vec4(ivec4(word & 0xffu, (word >> 8) & 0xffu, (word >> 16) & 0xffu, word >> 24));
}

// Returns where a ray passes four planes. `start`, `step`: where it passes the base of the cells, and how far it is
// from cell to cell.
vec4 page_planes(uint word, float start, float step) {
    precise vec4 planes = start + page_cells(word) * step;
    return planes;
}

// Tests the four children of a node. The sums round by at most 7 * 2^-24 of the reach, which the slack covers
// (engine/rays/packed_bvh.cpp). The boxes of pages have no rounding of their own, and rays are not placed on a grid.
BoxHits intersect_page_boxes(BoxRay ray, uvec4 frame, uvec4 xy, uvec2 z, float t_min, float t_exit) {
    vec3 base = uintBitsToFloat(frame.xyz);
    vec3 side = uintBitsToFloat((uvec3(frame.w, frame.w >> 8, frame.w >> 16) & 0xffu) << 23);
    precise vec3 near = (base - ray.near_origin) * ray.near_inverse;
    precise vec3 far = (base - ray.far_origin) * ray.far_inverse;
    precise vec3 near_step = side * ray.near_inverse;
    precise vec3 far_step = side * ray.far_inverse;
    return hits_between(page_planes(ray.backward.x ? xy.y : xy.x, near.x, near_step.x),
                        page_planes(ray.backward.y ? xy.w : xy.z, near.y, near_step.y),
                        page_planes(ray.backward.z ? z.y : z.x, near.z, near_step.z),
                        page_planes(ray.backward.x ? xy.x : xy.y, far.x, far_step.x),
                        page_planes(ray.backward.y ? xy.z : xy.w, far.y, far_step.y),
                        page_planes(ray.backward.z ? z.x : z.y, far.z, far_step.z), t_min, t_exit);
}

// Unpacks four cells from two words, through int, because few processors convert from unsigned.
vec4 cells_of(uvec2 words) {
    return vec4(ivec4(words.x & 0xffffu, words.x >> 16, words.y & 0xffffu, words.y >> 16));
}

void order_pair(inout BvhStep s, const int i, const int j) {
    bool swapped = s.near[j] < s.near[i];
    ivec2 near = swapped ? ivec2(s.near[j], s.near[i]) : ivec2(s.near[i], s.near[j]);
    uvec2 reference =
        swapped ? uvec2(s.reference[j], s.reference[i]) : uvec2(s.reference[i], s.reference[j]);
    s.near[i] = near.x;
    s.near[j] = near.y;
    s.reference[i] = reference.x;
    s.reference[j] = reference.y;
}

// Returns four bounds of a node in the float format.
vec4 float_bounds(int texel) { return uintBitsToFloat(texelFetch(trace_nodes, texel)); }

// Tests the children `slots` of a node against the part [t_min, t_exit] of the ray.
BvhStep bvh_step(BoxRay ray, uint node, float t_min, float t_exit, bvec4 slots) {
    int index = int(node & kBvhIndexMask);
    BoxHits hits;
    BvhStep s;
    if (kFloatNodes) {
        // The texture fetch selects the side by which the ray enters.
        ivec3 enter = index * kBvhFloatTexels + ivec3(0, 2, 4) + ivec3(ray.backward);
        ivec3 leave = index * kBvhFloatTexels + ivec3(1, 3, 5) - ivec3(ray.backward);
        hits = intersect_boxes(ray, float_bounds(enter.x), float_bounds(enter.y), float_bounds(enter.z),
                               float_bounds(leave.x), float_bounds(leave.y), float_bounds(leave.z), t_min, t_exit);
        s.reference = texelFetch(trace_nodes, index * kBvhFloatTexels + 6);
    } else if (kPageNodes) {
        uvec4 frame = texelFetch(trace_nodes, int(node));
        uvec4 xy = texelFetch(trace_nodes, int(node) + 1);
        uvec4 z = texelFetch(trace_nodes, int(node) + 2);
        hits = intersect_page_boxes(ray, frame, xy, z.xy, t_min, t_exit);
        uvec4 codes = uvec4(z.w & 0xffu, (z.w >> 8) & 0xffu, (z.w >> 16) & 0xffu, z.w >> 24);
        uvec4 offsets = codes & kBvhPageNoChild;
        s.reference = (node + z.z) + offsets + ((codes - offsets) << (kBvhPageCountShift - kBvhPageOffsetBits));
        // The box of a missing child is empty, but smaller than the slack if the node is small.
        hits.met = bvec4(uvec4(hits.met) & uvec4(notEqual(codes, uvec4(kBvhPageNoChild))));
    } else {
        int texel = index * kBvhGridTexels;
        uvec4 x = texelFetch(trace_nodes, texel);
        uvec4 y = texelFetch(trace_nodes, texel + 1);
        uvec4 z = texelFetch(trace_nodes, texel + 2);
        hits = intersect_boxes(
            ray, cells_of(ray.backward.x ? x.zw : x.xy), cells_of(ray.backward.y ? y.zw : y.xy),
            cells_of(ray.backward.z ? z.zw : z.xy), cells_of(ray.backward.x ? x.xy : x.zw),
            cells_of(ray.backward.y ? y.xy : y.zw), cells_of(ray.backward.z ? z.xy : z.zw), t_min, t_exit);
        s.reference = texelFetch(trace_nodes, texel + 3);
    }
    s.near = mix(ivec4(kBvhFar), hits.near, bvec4(uvec4(hits.met) & uvec4(slots)));
    order_pair(s, 0, 1);
    order_pair(s, 2, 3);
    order_pair(s, 0, 2);
    order_pair(s, 1, 3);
    order_pair(s, 1, 2);
    return s;
}

BvhStep bvh_step(BoxRay ray, uint node, float t_min, float t_exit) {
    return bvh_step(ray, node, t_min, t_exit, bvec4(true));
}
