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
