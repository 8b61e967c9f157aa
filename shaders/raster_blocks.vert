// Draws one point of 8x8 texels per block of tiles, at one texel per tile; drops it if no candidate can meet any of
// its rays.
#include "shaders/lib/raster_boxes.glsl"

flat out uint block_candidates;

void main() {
    uint block = uint(gl_VertexID);
    TimedTest shaft = shaft_test(fetch_shaft(tile_count + block), hull, slack);
    float near = kShaftBig;
    block_candidates = 0u;
    for (uint i = 0u; i < candidate_count; ++i) {
        float t = candidate_near(shaft, i);
        if (t >= 0.0) {
            near = min(near, t);
            block_candidates |= 1u << i;
        }
    }
    bool dropped = block_candidates == 0u;
    vec2 centre = vec2(texel_of_block(block)) * 8.0 + 4.0;
    gl_Position = vec4(centre / vec2(tile_texels) * 2.0 - 1.0, dropped ? 2.0 : depth_of(near), 1.0);
}
