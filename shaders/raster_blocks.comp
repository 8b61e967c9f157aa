// Shafts of blocks of 64 tiles.
#include "shaders/lib/raster_shaft.glsl"

layout(local_size_x = 8) in;
layout(std430, binding = 3) buffer Shafts { vec4 shafts[]; };
uniform uint tile_count;

void main() {
    uint block = gl_GlobalInvocationID.x;
    if (block * 64u >= tile_count) return;
    Shaft shaft = empty_shaft();
    for (uint tile = block * 64u; tile < block * 64u + 64u; ++tile) {
        vec4 from_lower = shafts[4u * tile];
        shaft = shaft_union(shaft, Shaft(from_lower.xyz, shafts[4u * tile + 1u].xyz, shafts[4u * tile + 2u].xyz,
                                         shafts[4u * tile + 3u].xyz, from_lower.w));
    }
    uint at = 4u * (tile_count + block);
    shafts[at] = vec4(shaft.from_lower, shaft.least_t);
    shafts[at + 1u] = vec4(shaft.from_upper, 0.0);
    shafts[at + 2u] = vec4(shaft.to_lower, 0.0);
    shafts[at + 3u] = vec4(shaft.to_upper, 0.0);
}
