// Draws one point of 8x8 texels per tile, at one texel per ray; drops it if the tile's list is empty.
#include "shaders/shared/raster_lists.h"
#include "shaders/lib/raster_texels.glsl"

uniform usampler2D list_sizes;  // R32UI: entries of a tile's list
uniform ivec2 tile_texels;

flat out uint list_size;
flat out uint first_entry;

void main() {
    uvec2 texel = texel_of_tile(uint(gl_VertexID));
    list_size = texelFetch(list_sizes, ivec2(texel), 0).x;
    first_entry = uint(gl_VertexID) * kRasterList;
    vec2 position = (vec2(texel) + 0.5) / vec2(tile_texels) * 2.0 - 1.0;
    gl_Position = vec4(position, list_size == 0u ? 2.0 : 0.0, 1.0);
}
