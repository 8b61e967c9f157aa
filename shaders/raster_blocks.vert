// One point of 8x8 texels per block of tiles, at one texel per tile; dropped where no candidate concerns any of its rays.
#include "shaders/lib/raster_boxes.glsl"

flat out uvec4 block_candidates;

void main() {
    uint block = uint(gl_VertexID);
    ShaftTest shaft = shaft_test(fetch_shaft(tile_count + block), hull, slack);
    float near = kShaftBig;
    block_candidates = uvec4(0u);
#ifdef HALFLIGHT_MASK
    for (uint leaf = 0u; leaf < kRasterLeaves; ++leaf) {
        uint first = leaf * kRasterLeafPieces;
        uint met = 0u;
        for (uint left = leaf_sizes[leaf >> 2][leaf & 3u], i = 0u; i < left; ++i) {
            float t = candidate_near(shaft, first + i);
            if (t >= 0.0) met |= 1u << i;
            if (i == 0u) {
                near = t >= 0.0 ? min(near, t) : near;
                left = t >= 0.0 ? left : 0u;
            }
        }
        block_candidates[leaf >> 1] |= met << ((leaf & 1u) * 16u);
    }
#else
    for (uint i = 0u; i < candidate_count; ++i) {
        float t = candidate_near(shaft, i);
        if (t >= 0.0) {
            near = min(near, t);
            block_candidates[i >> 5] |= 1u << (i & 31u);
        }
    }
#endif
    bool dropped = block_candidates == uvec4(0u);
    vec2 centre = vec2(texel_of_block(block)) * 8.0 + 4.0;
    gl_Position = vec4(centre / vec2(tile_texels) * 2.0 - 1.0, dropped ? 2.0 : depth_of(near), 1.0);
}
