// References to nodes, leaves and triangles of scenes that are loaded in pages (shaders/shared/bvh_nodes.h). shaders/lib/
// traverse.glsl has them for other scenes, and says what they mean.
const uint kStackLeaf = 1u << kBvhPageCountShift;
const uint kStackBeyond = 0x80000000u;
const uint kNoPlace = kBvhPageNoPlace;

int first_place(uint leaf) { return 2 * int(leaf & kBvhPageIndexMask); }
int places_in(uint leaf) { return leaf < kBvhPageMissing ? 2 * int(leaf >> kBvhPageCountShift) : 0; }
uint leaf_of(uint pairs, uint first) { return (pairs << kBvhPageCountShift) | first; }

#if HALFLIGHT_ALPHA
uniform usamplerBuffer first_rows;  // per texel of a pair: place of its first alpha-tested triangle among the slot's rows

uint row_of(int place, uint triangle) {
    int pair = place >> 1;
    uint first = texelFetch(trace_nodes, pair).x;
    bool follows = (first & kBvhPageAlpha) != 0u && (first & kBvhTriangleMask) != triangle;
    uint slot = uint(pair / HALFLIGHT_SLOT_TEXELS);
    return (slot * uint(HALFLIGHT_SLOT_ROWS)) + texelFetch(first_rows, pair).x + (follows ? 1u : 0u);
}
#endif
