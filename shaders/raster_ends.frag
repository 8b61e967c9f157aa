// Stores the remaining reach of a tile's rays as depth, one texel per tile. It runs after some tiles were traced.
#include "shaders/shared/raster_lists.h"
#include "shaders/lib/batch_answers.glsl"
#include "shaders/lib/batch_paths.glsl"
#include "shaders/lib/batch_rays.glsl"
#include "shaders/lib/raster_texels.glsl"

uniform usampler2D list_sizes;  // R32UI: entries of a tile's list
uniform samplerBuffer shafts;   // RGBA32F, 4 texels each: shafts of tiles
layout(std430) readonly buffer Alive { uvec2 alive[]; };

uniform bool completely;  // true: nothing is left to be traced

void main() {
    uvec2 texel = uvec2(gl_FragCoord.xy);
    if (texelFetch(list_sizes, ivec2(texel), 0).x == 0u) discard;
    uint tile = tile_of_texel(texel);
    uvec2 living = completely ? uvec2(0u) : alive[tile];
    float greatest_t = texelFetch(shafts, int(4u * tile + 1u)).w;
    float end = -1.0;
    for (uint word = 0u; word < 2u; ++word) {
        for (uint left = living[word]; left != 0u && end < greatest_t; left &= left - 1u) {
            uint path = path_of(tile * 64u + word * 32u + uint(findLSB(left)));
            if (kAnyHit) {
                if (occluded[path] == kFree) end = greatest_t;
            } else {
                float t = hits[path].t;
                // A NaN does not count, because no later hit can replace it.
                if (floatBitsToUint(t) <= 0x7f800000u) end = max(end, min(t, greatest_t));
            }
        }
    }
    gl_FragDepth = end < 0.0 ? kDeadDepth : depth_of(end);
}
