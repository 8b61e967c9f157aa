// Which candidates can rays of this tile meet before they end? Fragments pass where there is one: an occlusion query over
// them asks whether any tile needs any candidate. The depth test has dropped tiles of which all rays end before the block's
// nearest candidate; here each candidate is held against the tile's own depth.
//
// HALFLIGHT_MASK: the answer is kept, and candidates come by leaves. Where a tile meets several of a leaf's parts, all of it
// takes their place: rays find the way from there faster than through a list. HALFLIGHT_WIDE: tiles that meet more candidates
// than that are marked instead.
#include "shaders/lib/raster_boxes.glsl"

layout(binding = UNIT_RASTER_DEPTH) uniform sampler2D tile_depth;

flat in uvec4 block_candidates;
#if defined(HALFLIGHT_MASK) || defined(HALFLIGHT_WIDE)
layout(location = 0) out uvec4 candidates;
#else
uvec4 candidates;
#endif

void main() {
    uvec2 texel = uvec2(gl_FragCoord.xy);
    ShaftTest shaft = shaft_test(fetch_shaft(tile_of_texel(texel)), hull, slack);
    float depth = texelFetch(tile_depth, ivec2(texel), 0).x;
    candidates = uvec4(0u);
#ifdef HALFLIGHT_MASK
    for (uint leaf = 0u; leaf < kRasterLeaves; ++leaf) {
        uint shift = (leaf & 1u) * 16u;
        uint left = (block_candidates[leaf >> 1] >> shift) & 0xffffu;
        uint met = 0u;
        while (left != 0u) {
            uint bit = uint(findLSB(left));
            float near = candidate_near(shaft, leaf * kRasterLeafPieces + bit);
            bool meets = near >= 0.0 && depth_of(near) <= depth;
            met |= meets ? 1u << bit : 0u;
            left = meets || bit != 0u ? left & (left - 1u) : 0u;
        }
        uint parts = met & 0xfffeu;
        bool cut = leaf_sizes[leaf >> 2][leaf & 3u] > 1u;
        candidates[leaf >> 1] |= (cut && bitCount(parts) <= 1 ? parts : met & 1u) << shift;
    }
#else
    for (uint word = 0u; word < 4u; ++word) {
        for (uint left = block_candidates[word]; left != 0u; left &= left - 1u) {
            uint bit = uint(findLSB(left));
            float near = candidate_near(shaft, word * 32u + bit);
            if (near >= 0.0 && depth_of(near) <= depth) candidates[word] |= 1u << bit;
        }
    }
#endif
#ifdef HALFLIGHT_WIDE
    ivec4 counts = bitCount(candidates);
    candidates = uvec4(counts.x + counts.y + counts.z + counts.w > HALFLIGHT_WIDE ? 1u : 0u, 0u, 0u, 0u);
#endif
    if (candidates == uvec4(0u)) discard;
}
