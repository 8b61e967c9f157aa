// One point of 8x8 texels per block of tiles, at one texel per tile; dropped where none of the candidates concerns any of
// its tiles. Candidates: boxes of UNIT_BOXES, which the fragments test again, tile by tile.
#include "shaders/lib/raster_boxes.glsl"

#ifdef HALFLIGHT_BOUNDS
void main() {
    gl_Position = vec4((vec2(texel_of_block(uint(gl_VertexID))) * 8.0 + 4.0) / vec2(tile_texels) * 2.0 - 1.0, 0.0, 1.0);
}
#else
flat out uvec4 candidates;

void main() {
    uvec2 texel = texel_of_block(uint(gl_VertexID));
    ShaftTest shaft = shaft_test(fetch_shaft(block_shafts, ivec2(texel)), hull, slack);
    float near = kShaftBig;
    candidates = uvec4(0u);
    for (uint i = 0u; i < candidate_count; ++i) {
        float t = candidate_near(shaft, i);
        if (t >= 0.0) {
            near = min(near, t);
            candidates[i >> 5] |= 1u << (i & 31u);
        }
    }
    bool dropped = candidates == uvec4(0u);
    vec2 position = (vec2(texel) * 8.0 + 4.0) / vec2(tile_texels) * 2.0 - 1.0;
    gl_Position = vec4(position, dropped ? 2.0 : depth_of(near), 1.0);
}
#endif
