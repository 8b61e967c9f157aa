// Positions of a batch's entries as texels. 64 consecutive entries are a tile of 8x8 texels, and 64 consecutive tiles
// are a block of 8x8 tiles, both in Morton order like pixels (shaders/shared/pixel_order.h). Blocks are laid out row by
// row.
//
// Depth orders distances along rays, dead rays first. It has half of the bits of t, hence steps of two neighbouring
// floats. It never reverses the order of two distances, and is always a normal number in [0, 1].
#include "shaders/shared/pixel_order.h"

uniform uint block_columns;

uint morton(uvec2 p) { return (morton_spread(p.y) << 1) | morton_spread(p.x); }
uvec2 from_morton(uint m) { return uvec2(morton_even_bits(m), morton_even_bits(m >> 1)); }

uint tile_of_texel(uvec2 texel) {  // Returns the tile of a texel in targets with one texel per tile.
    uvec2 block = texel >> 3u;
    return ((block.y * block_columns + block.x) << 6) | morton(texel & 7u);
}
uint entry_of_texel(uvec2 texel) {  // Returns the entry of a texel in targets with one texel per ray.
    return (tile_of_texel(texel >> 3u) << 6) | morton(texel & 7u);
}
uvec2 texel_of_block(uint block) { return uvec2(block % block_columns, block / block_columns); }
uvec2 texel_of_tile(uint tile) { return texel_of_block(tile >> 6) * 8u + from_morton(tile & 63u); }

const float kDeadDepth = 0.0;

float depth_of(float t) {  // Returns the depth of t, which is >= 0 or +inf.
    return uintBitsToFloat((min(floatBitsToUint(t), 0x7e000000u) >> 1) + 0x00800000u);
}

// Returns the largest t with that depth.
float reach_of(float depth) {
    uint bits = floatBitsToUint(depth);
    return depth == kDeadDepth ? -1.0 : uintBitsToFloat(depth >= 1.0 ? 0x7f800000u : ((bits - 0x00800000u) << 1) | 1u);
}
