// Path index <-> pixel of a band. 256 consecutive paths are one 16x16 block in Morton order, so 64 are one 8x8 tile.
// Block rows are interleaved, even ones first: software drivers hand the first half of the work groups to one thread and
// the second to another, and a picture's top and bottom seldom cost the same.

uint morton_even_bits(uint m) {
    m &= 0x55u;
    m = (m | (m >> 1)) & 0x33u;
    return (m | (m >> 2)) & 0x0fu;
}

uint morton_spread(uint v) {
    v = (v | (v << 2)) & 0x33u;
    return (v | (v << 1)) & 0x55u;
}

// Pixel relative to the band's first row; may lie outside of it where the band is no multiple of 16.
ivec2 pixel_of_path(uint path, uvec2 tiles) {
    uint block = path >> 8;
    uint rank = block / tiles.x;
    uint even_rows = (tiles.y + 1u) >> 1;
    uint row = rank < even_rows ? 2u * rank : 2u * (rank - even_rows) + 1u;
    uint m = path & 255u;
    return ivec2((block - rank * tiles.x) * 16u + morton_even_bits(m), row * 16u + morton_even_bits(m >> 1));
}

uint path_of_pixel(ivec2 pixel, uvec2 tiles) {
    uvec2 p = uvec2(pixel);
    uint row = p.y >> 4;
    uint even_rows = (tiles.y + 1u) >> 1;
    uint rank = (row & 1u) == 0u ? row >> 1 : even_rows + (row >> 1);
    return ((rank * tiles.x + (p.x >> 4)) << 8) | (morton_spread(p.y & 15u) << 1) | morton_spread(p.x & 15u);
}
