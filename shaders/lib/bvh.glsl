// One traversal step of a hierarchy. Needs shaders/trace_scene.glsl.
#include "shaders/lib/box.glsl"

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

#ifdef HALFLIGHT_NODES_FLOAT
BvhHead bvh_head(uint index) {
    int texel = int(index) * kBvhFloatTexels;
    vec4 base = texelFetch(trace_nodes, texel);
    return BvhHead(base.xyz, texelFetch(trace_nodes, texel + 1).xyz, base.w);
}
#else
BvhHead bvh_head(uint index) {
    int texel = int(index) * kBvhGridTexels;
    vec4 base = uintBitsToFloat(texelFetch(trace_nodes, texel));
    return BvhHead(base.xyz, uintBitsToFloat(texelFetch(trace_nodes, texel + 1).xyz), base.w);
}

#ifdef HALFLIGHT_NODES_PAGE
// Decodes the bounds of four children along an axis, from a word with four numbers of cells.
vec4 page_bounds(uint cells, uint base, uint exponents, const int axis) {
    float side = uintBitsToFloat(((exponents >> (8 * axis)) & 0xffu) << 23);
    vec4 count = vec4(ivec4(cells & 0xffu, (cells >> 8) & 0xffu, (cells >> 16) & 0xffu, cells >> 24));
    precise vec4 bounds = uintBitsToFloat(base) + count * side;
    return bounds;
}
#endif

// Unpacks four cells from two words, through int, because few processors convert from unsigned.
vec4 cells_of(uvec2 words) {
    return vec4(ivec4(words.x & 0xffffu, words.x >> 16, words.y & 0xffffu, words.y >> 16));
}
#endif

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

// Tests the children `slots` of a node against the part [t_min, t_exit] of the ray.
BvhStep bvh_step(BoxRay ray, uint node, float t_min, float t_exit, bvec4 slots) {
    int index = int(node & kBvhIndexMask);
#ifdef HALFLIGHT_NODES_FLOAT
    // The texture fetch selects the side by which the ray enters.
    ivec3 enter = index * kBvhFloatTexels + ivec3(0, 2, 4) + ivec3(ray.backward);
    ivec3 leave = index * kBvhFloatTexels + ivec3(1, 3, 5) - ivec3(ray.backward);
    BoxHits hits = intersect_boxes(ray, texelFetch(trace_nodes, enter.x), texelFetch(trace_nodes, enter.y),
                                   texelFetch(trace_nodes, enter.z), texelFetch(trace_nodes, leave.x),
                                   texelFetch(trace_nodes, leave.y), texelFetch(trace_nodes, leave.z), t_min, t_exit);
    BvhStep s;
    s.reference = floatBitsToUint(texelFetch(trace_nodes, index * kBvhFloatTexels + 6));
#elif defined(HALFLIGHT_NODES_PAGE)
    int texel = index * kBvhPageTexels;
    uvec4 frame = texelFetch(trace_nodes, texel);
    uvec4 xy = texelFetch(trace_nodes, texel + 1);
    uvec4 z = texelFetch(trace_nodes, texel + 2);
    BoxHits hits = intersect_boxes(ray, page_bounds(ray.backward.x ? xy.y : xy.x, frame.x, frame.w, 0),
                                   page_bounds(ray.backward.y ? xy.w : xy.z, frame.y, frame.w, 1),
                                   page_bounds(ray.backward.z ? z.y : z.x, frame.z, frame.w, 2),
                                   page_bounds(ray.backward.x ? xy.x : xy.y, frame.x, frame.w, 0),
                                   page_bounds(ray.backward.y ? xy.z : xy.w, frame.y, frame.w, 1),
                                   page_bounds(ray.backward.z ? z.x : z.y, frame.z, frame.w, 2), t_min, t_exit);
    BvhStep s;
    s.reference = texelFetch(trace_nodes, texel + 3);
    // The box of a missing child is empty, but smaller than the slack where the node is small.
    hits.met = bvec4(uvec4(hits.met) & uvec4(notEqual(s.reference, uvec4(kBvhNoChild))));
#else
    int texel = index * kBvhGridTexels;
    uvec4 x = texelFetch(trace_nodes, texel);
    uvec4 y = texelFetch(trace_nodes, texel + 1);
    uvec4 z = texelFetch(trace_nodes, texel + 2);
    BoxHits hits = intersect_boxes(
        ray, cells_of(ray.backward.x ? x.zw : x.xy), cells_of(ray.backward.y ? y.zw : y.xy),
        cells_of(ray.backward.z ? z.zw : z.xy), cells_of(ray.backward.x ? x.xy : x.zw),
        cells_of(ray.backward.y ? y.xy : y.zw), cells_of(ray.backward.z ? z.xy : z.zw), t_min, t_exit);
    BvhStep s;
    s.reference = texelFetch(trace_nodes, texel + 3);
#endif
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
