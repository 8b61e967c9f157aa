// Mapping between path index and pixel of a band. 256 consecutive paths are one 16x16 block in Morton order, so 64 are
// one 8x8 tile. Block rows are interleaved, even ones first. Software drivers give the first half of the work groups to
// one thread and the second half to another. Top and bottom of a picture seldom have equal costs.
#pragma once

#include "shaders/shared/portable.h"

HALFLIGHT_SHARED_BEGIN

HALFLIGHT_SHARED_FUNCTION uint morton_even_bits(uint m) {
    m &= 0x55u;
    m = (m | (m >> 1)) & 0x33u;
    return (m | (m >> 2)) & 0x0fu;
}

// Spreads the 16 bits of v to the even bits.
HALFLIGHT_SHARED_FUNCTION uint morton_spread(uint v) {
    v = (v | (v << 8)) & 0x00ff00ffu;
    v = (v | (v << 4)) & 0x0f0f0f0fu;
    v = (v | (v << 2)) & 0x33333333u;
    return (v | (v << 1)) & 0x55555555u;
}

// Returns the pixel relative to the band's first row, for a band of tiles.x by tiles.y blocks. It may be outside the
// image if that is no multiple of 16.
HALFLIGHT_SHARED_FUNCTION uvec2 pixel_of_path(uint path, uvec2 tiles) {
    uint block = path >> 8;
    uint rank = block / tiles.x;
    uint even_rows = (tiles.y + 1u) >> 1;
    uint row = rank < even_rows ? 2u * rank : 2u * (rank - even_rows) + 1u;
    uint m = path & 255u;
    return uvec2((block - rank * tiles.x) * 16u + morton_even_bits(m), row * 16u + morton_even_bits(m >> 1));
}

HALFLIGHT_SHARED_FUNCTION uint path_of_pixel(uvec2 pixel, uvec2 tiles) {
    uint row = pixel.y >> 4;
    uint even_rows = (tiles.y + 1u) >> 1;
    uint rank = (row & 1u) == 0u ? row >> 1 : even_rows + (row >> 1);
    return ((rank * tiles.x + (pixel.x >> 4)) << 8) | (morton_spread(pixel.y & 15u) << 1) |
           morton_spread(pixel.x & 15u);
}

HALFLIGHT_SHARED_END
