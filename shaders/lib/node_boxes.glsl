// The boxes of a node's four children, for tests against all of them. Needs shaders/trace_scene.glsl.
struct NodeBoxes {
    vec4 lower[3];  // lower bounds of four children, by axis
    vec4 upper[3];
    uvec4 reference;
};

// Packs four booleans to bits.
uint mask_of(bvec4 b) { return uint(b.x) | uint(b.y) << 1 | uint(b.z) << 2 | uint(b.w) << 3; }

// Returns the boxes in the units of the hierarchy.
NodeBoxes load_node(uint node) {
    int index = int(node & kBvhIndexMask);
    NodeBoxes n;
#if HALFLIGHT_NODES_FLOAT
    for (int a = 0; a < 3; ++a) {
        n.lower[a] = texelFetch(trace_nodes, index * kBvhFloatTexels + 2 * a);
        n.upper[a] = texelFetch(trace_nodes, index * kBvhFloatTexels + 2 * a + 1);
    }
    n.reference = floatBitsToUint(texelFetch(trace_nodes, index * kBvhFloatTexels + 6));
#else
    for (int a = 0; a < 3; ++a) {
        uvec4 cells = texelFetch(trace_nodes, index * kBvhGridTexels + a);
        n.lower[a] = cells_of(cells.xy);
        n.upper[a] = cells_of(cells.zw);
    }
    n.reference = texelFetch(trace_nodes, index * kBvhGridTexels + 3);
#endif
    return n;
}
