// The subtrees of pages around a point (engine/paging/page_pool.h). Needs shaders/lib/bvh.glsl.
struct Subtree {
    uint number;    // place of its root in that hierarchy, which does not depend on the pool; 0: none
    bool resident;  // its page is in the pool
};

// Returns the four bounds of a node's children along an axis.
vec4 page_bounds(uint word, uvec4 frame, const int axis) {
    float side = uintBitsToFloat(((frame.w >> (8 * axis)) & 0xffu) << 23);
    return uintBitsToFloat(frame[axis]) + page_cells(word) * side;
}

// Returns the smallest subtree whose box has a point. `error` bounds the error of the point's coordinates.
Subtree subtree_around(vec3 point, float error) {
    const int kMostEntries = 96;  // three for each level; hierarchies over roots are not as deep
    Subtree best = Subtree(0u, false);
    float least = uintBitsToFloat(uint(kBvhFar));
    uint entries[kMostEntries];
    float extents[kMostEntries];  // diagonals of their boxes
    entries[0] = top + uint(kBvhPageTexels);
    extents[0] = 0.0;
    int count = 1;
    while (count > 0) {
        uint node = entries[--count];
        uvec4 frame = texelFetch(trace_nodes, int(node));
        uvec4 xy = texelFetch(trace_nodes, int(node) + 1);
        uvec4 z = texelFetch(trace_nodes, int(node) + 2);
        vec4 lower_x = page_bounds(xy.x, frame, 0), upper_x = page_bounds(xy.y, frame, 0);
        vec4 lower_y = page_bounds(xy.z, frame, 1), upper_y = page_bounds(xy.w, frame, 1);
        vec4 lower_z = page_bounds(z.x, frame, 2), upper_z = page_bounds(z.y, frame, 2);
        uint below = node + z.z;
        if (below < top || below >= kBvhPageMissing) {  // a root, whose children are in its slot or missing
            if (extents[count] < least) {
                least = extents[count];
                best = Subtree((node - top) / uint(kBvhPageTexels), below < top);
            }
            continue;
        }
        for (int k = 0; k < 4; ++k) {
            uint code = (z.w >> (8 * k)) & 0xffu;
            vec3 lower = vec3(lower_x[k], lower_y[k], lower_z[k]), upper = vec3(upper_x[k], upper_y[k], upper_z[k]);
            bool inside = code != kBvhPageNoChild && all(greaterThanEqual(point + error, lower)) &&
                          all(lessThanEqual(point - error, upper));
            if (!inside || count == kMostEntries) continue;
            entries[count] = below + code;
            extents[count] = length(upper - lower);
            ++count;
        }
    }
    return best;
}
