// Computes the shafts of blocks of 64 tiles.
#include "shaders/lib/raster_shaft.glsl"

layout(local_size_x = 8) in;
layout(std430) buffer Shafts { vec4 shafts[]; };
uniform uint tile_count;

void main() {
    uint block = gl_GlobalInvocationID.x;
    if (block * 64u >= tile_count) return;
    TimedShaft shaft = empty_shaft();
    for (uint tile = block * 64u; tile < block * 64u + 64u; ++tile) {
        vec4 origin_lower = shafts[4u * tile];
        Shaft rays = Shaft(origin_lower.xyz, shafts[4u * tile + 1u].xyz, shafts[4u * tile + 2u].xyz,
                           shafts[4u * tile + 3u].xyz);
        shaft = shaft_union(shaft, TimedShaft(rays, origin_lower.w));
    }
    uint at = 4u * (tile_count + block);
    shafts[at] = vec4(shaft.rays.origin_lower, shaft.least_t);
    shafts[at + 1u] = vec4(shaft.rays.origin_upper, 0.0);
    shafts[at + 2u] = vec4(shaft.rays.end_lower, 0.0);
    shafts[at + 3u] = vec4(shaft.rays.end_upper, 0.0);
}
