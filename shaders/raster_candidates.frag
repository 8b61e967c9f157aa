// Tests whether rays of this tile can meet a candidate before they end. Fragments pass if they can, so an occlusion
// query tells whether any tile needs any candidate. The depth test has dropped tiles whose rays all end before the
// block's nearest candidate. Here each candidate is compared with the tile's own depth.
//
// HALFLIGHT_WIDE: fragments pass if rays can meet more candidates than this number; the list is then the whole scene.
#include "shaders/lib/raster_boxes.glsl"

uniform sampler2D tile_depth;  // maximum reach of the tile's rays

flat in uint block_candidates;
layout(location = 0) out uint list_size;
OPTIONAL(HALFLIGHT_WIDE) layout(std430) writeonly buffer Lists { uint lists[]; };

void main() {
    uvec2 texel = uvec2(gl_FragCoord.xy);
    uint tile = tile_of_texel(texel);
    TimedTest shaft = shaft_test(fetch_shaft(tile), hull, slack);
    float reach = reach_of(texelFetch(tile_depth, ivec2(texel), 0).x);
    int met = 0;
    for (uint left = block_candidates; left != 0u; left &= left - 1u) {
        float near = candidate_near(shaft, uint(findLSB(left)));
        met += near >= 0.0 && near <= reach ? 1 : 0;
    }
    if (met <= HALFLIGHT_WIDE) discard;
    if (HALFLIGHT_WIDE != 0) {
        lists[tile * kRasterList] = 1u | 15u << kRasterSlotShift;
        list_size = 1u;
    }
}
