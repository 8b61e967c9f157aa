// Shafts and up to 32 candidates of a tile, for kernels of the raster back end that draw one texel per tile.
#include "shaders/shared/raster_lists.h"
#include "shaders/lib/raster_shaft.glsl"
#include "shaders/lib/raster_texels.glsl"

uniform samplerBuffer boxes;   // RGBA32F, 2 texels per box, xyz: lower and upper end, world
uniform samplerBuffer shafts;  // RGBA32F, 4 texels per shaft: tiles, then blocks

uniform uint tile_count;  // number of tiles, a multiple of 64
uniform ivec2 tile_texels;  // size of the target, texels
uniform float hull;         // greatest coordinate of the hierarchy
uniform float slack;        // slack of the hierarchy at index 0
uniform uint candidate_count;
uniform uvec4 candidate_boxes[8];  // indices into boxes, near ones first

TimedShaft fetch_shaft(uint index) {
    int texel = int(index) * 4;
    vec4 origin_lower = texelFetch(shafts, texel);
    Shaft rays = Shaft(origin_lower.xyz, texelFetch(shafts, texel + 1).xyz, texelFetch(shafts, texel + 2).xyz,
                       texelFetch(shafts, texel + 3).xyz);
    return TimedShaft(rays, origin_lower.w);
}

int box_of_candidate(uint candidate) { return int(candidate_boxes[candidate >> 2][candidate & 3u]); }

// Returns the entry of the shaft's rays into the candidate's box, or a negative number.
float candidate_near(TimedTest shaft, uint candidate) {
    int box = box_of_candidate(candidate) * 2;
    return shaft_near(shaft, texelFetch(boxes, box).xyz, texelFetch(boxes, box + 1).xyz);
}
