// Which candidates can rays of this tile meet before they end? Fragments pass where there is one: an occlusion query over
// them asks whether any tile needs any candidate. The depth test has dropped tiles of which all rays end before the block's
// nearest candidate; here each candidate is held against the tile's own depth. HALFLIGHT_MASK: the answer is kept.
#include "shaders/lib/raster_boxes.glsl"

layout(binding = UNIT_RASTER_DEPTH) uniform sampler2D tile_depth;

flat in uvec4 block_candidates;
#ifdef HALFLIGHT_MASK
layout(location = 0) out uvec4 candidates;
#else
uvec4 candidates;
#endif

void main() {
    uvec2 texel = uvec2(gl_FragCoord.xy);
    ShaftTest shaft = shaft_test(fetch_shaft(tile_of_texel(texel)), hull, slack);
    float depth = texelFetch(tile_depth, ivec2(texel), 0).x;
    candidates = uvec4(0u);
    for (uint word = 0u; word < 4u; ++word) {
        for (uint left = block_candidates[word]; left != 0u; left &= left - 1u) {
            uint bit = uint(findLSB(left));
            float near = candidate_near(shaft, word * 32u + bit);
            if (near >= 0.0 && depth_of(near) <= depth) candidates[word] |= 1u << bit;
        }
    }
    if (candidates == uvec4(0u)) discard;
}
