// The subtrees of pages around a point (engine/paging/page_pool.h). Needs shaders/lib/bvh.glsl.

struct Subtree {
    uint number;    // its place in the hierarchy over all pages, which does not change; 0: none
    bool resident;  // its page is in the pool
};

// Returns the smallest subtree whose box has a point. `error` bounds the error of the point's coordinates.
Subtree subtree_around(vec3 point, float error) {
    const int kMostEntries = 96;  // three for each level; hierarchies over boxes are not as deep
    uint top_nodes = texelFetch(trace_nodes, 2).x;  // the head has room for it
    Subtree best = Subtree(0u, false);
    float least = uintBitsToFloat(uint(kBvhFar));
    uint entries[kMostEntries];
    entries[0] = 1u;
    int count = 1;
    while (count > 0) {
        uint node = entries[--count];
        int texel = int(node) * kBvhPageTexels;
        uvec4 frame = texelFetch(trace_nodes, texel);
        uvec4 xy = texelFetch(trace_nodes, texel + 1);
        uvec4 z = texelFetch(trace_nodes, texel + 2);
        vec4 lower_x = page_bounds(xy.x, frame.x, frame.w, 0), upper_x = page_bounds(xy.y, frame.x, frame.w, 0);
        vec4 lower_y = page_bounds(xy.z, frame.y, frame.w, 1), upper_y = page_bounds(xy.w, frame.y, frame.w, 1);
        vec4 lower_z = page_bounds(z.x, frame.z, frame.w, 2), upper_z = page_bounds(z.y, frame.z, frame.w, 2);
        uvec4 reference = texelFetch(trace_nodes, texel + 3);
        for (int k = 0; k < 4; ++k) {
            vec3 lower = vec3(lower_x[k], lower_y[k], lower_z[k]), upper = vec3(upper_x[k], upper_y[k], upper_z[k]);
            bool inside = reference[k] != kBvhNoChild && all(greaterThanEqual(point + error, lower)) &&
                          all(lessThanEqual(point - error, upper));
            if (!inside) continue;
            uint index = reference[k] & kBvhIndexMask;
            if (is_inner_node(reference[k]) && index < top_nodes) {
                if (count < kMostEntries) entries[count++] = index;
                continue;
            }
            float extent = length(upper - lower);
            if (extent >= least) continue;
            least = extent;
            best = Subtree(4u * node + uint(k), is_inner_node(reference[k]));
        }
    }
    return best;
}
