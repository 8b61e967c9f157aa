// One point of 8x8 texels per tile, at one texel per ray; dropped where no candidate concerns it.
#include "shaders/shared/raster.h"
#include "shaders/lib/raster_texels.glsl"

layout(binding = UNIT_RASTER_MASK) uniform usampler2D tile_candidates;
uniform ivec2 tile_texels;

flat out uvec4 candidates;

void main() {
    uvec2 texel = texel_of_tile(uint(gl_VertexID));
    candidates = texelFetch(tile_candidates, ivec2(texel), 0);
    vec2 position = (vec2(texel) + 0.5) / vec2(tile_texels) * 2.0 - 1.0;
    gl_Position = vec4(position, candidates == uvec4(0u) ? 2.0 : 0.0, 1.0);
}
