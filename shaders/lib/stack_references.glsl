// References to nodes, leaves and triangles, as a traversal keeps them on its stack (shaders/shared/bvh_nodes.h). Needs
// shaders/lib/bvh.glsl.
const uint kStackDone = 0xffffffffu;
// Entries smaller than kStackLeaf are nodes, those smaller than kStackBeyond are nodes and leaves.
const uint kStackLeaf = kPageNodes ? 1u << kBvhPageCountShift : kBvhTag | kBvhLeaf;
const uint kStackBeyond = kPageNodes ? 0x80000000u : kBvhTag | kBvhInstance;
const uint kStackLeaveBlock = 0x7fffffffu;  // entry that returns to the top level
const uint kStackInstance = 0x70000000u;    // | instance; it is entered at the node below on the stack
const uint kNoPlace = kPageNodes ? kBvhPageNoPlace : kBvhNoChild;

// Returns the root of the hierarchy where traversal starts, and that of a block.
uint top_root() { return kPageNodes ? top + uint(kBvhPageTexels) : kBvhTag | 1u; }
uint block_root(uint head) { return kBvhTag | (head + 1u); }

// Returns the first place of a leaf. A place counts pairs of triangles in leaf order: twice the pair's index, plus 1
// after its first triangle.
int first_place(uint leaf) { return 2 * int(leaf & (kPageNodes ? kBvhPageIndexMask : kBvhIndexMask)); }
int places_in(uint leaf) {
    if (kPageNodes) return leaf < kBvhPageMissing ? 2 * int(leaf >> kBvhPageCountShift) : 0;
    return is_leaf(leaf) ? 2 * int((leaf >> kBvhCountShift) & 7u) : 0;
}
uint leaf_of(uint pairs, uint first) {
    return kPageNodes ? (pairs << kBvhPageCountShift) | first : kBvhTag | kBvhLeaf | (pairs << kBvhCountShift) | first;
}

// Pages: per texel of a pair, place of its first alpha-tested triangle among the rows of its slot.
uniform usamplerBuffer first_rows;
// Returns the row of a triangle in the tables. `place` is in its pair. In pages, only alpha-tested triangles have rows.
uint row_of(int place, uint triangle) {
    if (!kPageNodes) return triangle;
    int pair = place >> 1;
    uint first = texelFetch(trace_nodes, pair).x;
    bool follows = (first & kBvhPageAlpha) != 0u && (first & kBvhTriangleMask) != triangle;
    uint slot = uint(pair / kSlotTexels);
    return (slot * uint(HALFLIGHT_SLOT_ROWS)) + texelFetch(first_rows, pair).x + (follows ? 1u : 0u);
}

// Returns the id of a triangle of the tables, by which tests of alpha decide.
uniform usamplerBuffer triangle_ids;  // R32UI
uint triangle_id(uint triangle) {
    return HALFLIGHT_TRIANGLE_IDS != 0 ? texelFetch(triangle_ids, int(triangle)).x : triangle;
}
