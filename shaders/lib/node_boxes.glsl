// The boxes of a node's four children, for tests against all of them. Needs shaders/lib/bvh.glsl.
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
    int texel = index * (kFloatNodes ? kBvhFloatTexels : kBvhGridTexels);
    NodeBoxes n;
    for (int a = 0; a < 3; ++a) {
        if (kFloatNodes) {
            n.lower[a] = float_bounds(texel + 2 * a);
            n.upper[a] = float_bounds(texel + 2 * a + 1);
        } else {
            uvec4 cells = texelFetch(trace_nodes, texel + a);
            n.lower[a] = cells_of(cells.xy);
            n.upper[a] = cells_of(cells.zw);
        }
    }
    n.reference = texelFetch(trace_nodes, texel + (kFloatNodes ? 6 : 3));
    return n;
}
