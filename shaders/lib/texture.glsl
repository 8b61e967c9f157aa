// Texture lookups: bilinear or nearest, wraps and transforms of glTF. Needs shaders/scene_tables.glsl.
//
// HALFLIGHT_CHOOSE_LEVELS: lookups choose the mip level by `uv_footprint`; otherwise they use level 0.
//
// HALFLIGHT_TILE_REQUESTS: tiles that are missing are requested (engine/paging/tile_pool.h). Needs requested_bits,
// requested_tiles and requested_count of a storage block.
#include "shaders/shared/texture_rows.h"

const bool kTiledTextures = HALFLIGHT_TILED_TEXTURES != 0;
const bool kTileRequests = kTiledTextures && HALFLIGHT_TILE_REQUESTS != 0;
const bool kUvSet1 = HALFLIGHT_TEXTURE_UV_SET_1 != 0;
const bool kTransformedTextures = HALFLIGHT_TEXTURE_TRANSFORMS != 0;
const bool kDeepTextures = HALFLIGHT_TEXTURE_DEEP != 0;

struct TexelFootprint {
    ivec4 texel;  // places in the pool: upper left, upper right, lower left, lower right
    vec2 weight;  // weight of the right and of the lower texels
    bool deep;    // texels take two places
};

// Wraps one axis of a lookup at coordinate s, in texels; the axis has `size` texels.
void wrap_axis(float s, int size, uint wrap, bool nearest, out int first, out int second, out float weight) {
    bool mirror = HALFLIGHT_TEXTURE_MIRRORED != 0 && wrap == kWrapMirroredRepeat;
    bool clamped = HALFLIGHT_TEXTURE_CLAMPED != 0 && wrap == kWrapClampToEdge;
    bool repeat = !mirror && !clamped;
    float folded = fract(s);
    folded = mirror ? 1.0 - abs(1.0 - 2.0 * fract(0.5 * s)) : folded;
    folded = clamped ? clamp(s, 0.0, 1.0) : folded;
    float x = folded * float(size) - (nearest ? 0.0 : 0.5);
    float cell = floor(x);
    weight = nearest ? 0.0 : x - cell;
    first = int(cell);
    second = first + 1;
    first = first < 0 && repeat ? size - 1 : first;
    second = second >= size && repeat ? 0 : second;
    first = clamp(first, 0, size - 1);  // also keeps a NaN coordinate inside the pool
    second = clamp(second, 0, size - 1);
}

bool tiles_wanted = false;   // false: the invocation looks textures up in vain
uint missing_tile = kNoTile;  // lowest tile that the invocation misses; kNoTile: none

void request_tile(int tile) {
#if HALFLIGHT_TILE_REQUESTS
    uint bit = 1u << (uint(tile) & 31u);
    missing_tile = min(missing_tile, uint(tile));
    if ((atomicOr(requested_bits[tile >> 5], bit) & bit) == 0u)
        requested_tiles[atomicAdd(requested_count, 1u)] = uint(tile);
#endif
}

// Returns the places in the pool of the texels of two rows and two columns of a texture of `size` texels. Texels of
// missing tiles are in the blank slot. A tile has 2^shift columns.
ivec4 tiled_texels(int first_tile, ivec2 size, ivec2 rows, ivec2 columns, int shift) {
    int pitch = (size.x + (1 << shift) - 1) >> shift;
    ivec2 row_tiles = first_tile + (rows >> kTileRowShift) * pitch;
    ivec4 tiles = row_tiles.xxyy + (columns >> shift).xyxy;
    uvec4 slots;
    for (int k = 0; k < 4; ++k) slots[k] = texelFetch(tile_slots, tiles[k]).x;
    if (kTileRequests) {
        // The loop runs only if some tile is missing. A branch would not be skipped by software drivers.
        bvec4 absent = equal(slots, uvec4(kBlankSlot));
        for (int k = tiles_wanted && any(absent) ? 0 : 4; k < 4; ++k)
            if (absent[k]) request_tile(tiles[k]);
    }
    ivec2 in_rows = (rows & ((1 << kTileRowShift) - 1)) << shift;
    ivec2 in_columns = columns & ((1 << shift) - 1);
    return (ivec4(slots) << (kTileRowShift + shift)) + in_rows.xxyy + in_columns.xyxy;
}

// Area that the ray's cone covers in both sets of texture coordinates.
vec2 uv_footprint = vec2(0.0);

// Returns the last level whose texels are not larger than the footprint.
int texture_level(int row, uvec4 head) {
    float area = uv_footprint.x;
    if (kUvSet1) area = (head.w & kTextureUvSet1) != 0u ? uv_footprint.y : area;
    if (kTransformedTextures) {
        vec2 u = uintBitsToFloat(texelFetch(scene_textures, row + 1).xy);
        vec2 v = uintBitsToFloat(texelFetch(scene_textures, row + 2).xy);
        area *= abs(u.x * v.y - u.y * v.x);
    }
    float texels = area * float(head.y) * float(head.z);
    texels = texels > 1.0 ? texels : 1.0;  // NaN, too
    int level = (int(floatBitsToUint(texels) >> 23) - 127) >> 1;  // logarithm of the root, rounded down
    return min(level, int((head.w >> kTextureLastLevelShift) & 31u));
}

TexelFootprint texture_footprint(uint descriptor, vec2 uv0, vec2 uv1, int tile_shift) {
    int row = int(descriptor) * kTextureStride;
    uvec4 head = texelFetch(scene_textures, row);
    if (HALFLIGHT_CHOOSE_LEVELS != 0) {
        row += kTextureStride * texture_level(row, head);
        head = texelFetch(scene_textures, row);
    }
    uint flags = head.w;
    vec2 uv = kUvSet1 && (flags & kTextureUvSet1) != 0u ? uv1 : uv0;
    if (kTransformedTextures)
        uv = vec2(dot(uintBitsToFloat(texelFetch(scene_textures, row + 1).xyz), vec3(uv, 1.0)),
                  dot(uintBitsToFloat(texelFetch(scene_textures, row + 2).xyz), vec3(uv, 1.0)));
    bool nearest = HALFLIGHT_TEXTURE_NEAREST != 0 && (flags & kTextureNearest) != 0u;
    ivec2 size = ivec2(head.yz);
    ivec2 first, second;
    TexelFootprint f;
    wrap_axis(uv.x, size.x, flags & kTextureWrapMask, nearest, first.x, second.x, f.weight.x);
    wrap_axis(uv.y, size.y, (flags >> kTextureWrapVShift) & kTextureWrapMask, nearest, first.y, second.y, f.weight.y);
    f.deep = kDeepTextures && (flags & kTextureDeep) != 0u;
    if (f.deep) {
        size.x *= 2;
        first.x *= 2;
        second.x *= 2;
    }
    ivec2 rows = int(head.x) + ivec2(first.y, second.y) * size.x;
    f.texel = kTiledTextures
                  ? tiled_texels(int(head.x), size, ivec2(first.y, second.y), ivec2(first.x, second.x), tile_shift)
                  : ivec4(rows.x + first.x, rows.x + second.x, rows.y + first.x, rows.y + second.x);
    return f;
}

// Blends the texels of a footprint. The code is precise, so that all versions of Mesa compute equal bits.
vec4 blend_footprint(TexelFootprint f, vec4 a, vec4 b, vec4 c, vec4 d) {
    precise vec4 blended = mix(mix(a, b, f.weight.x), mix(c, d, f.weight.x), f.weight.y);
    return blended;
}

vec4 color_texel(int index) {
    if (HALFLIGHT_COLOR_BANK_1 != 0) {
        int bank = index >> HALFLIGHT_COLOR_BANK_SHIFT;
        index &= (1 << HALFLIGHT_COLOR_BANK_SHIFT) - 1;
        if (bank == 1) return texelFetch(color_bank_1, index);
        if (HALFLIGHT_COLOR_BANK_2 != 0 && bank == 2) return texelFetch(color_bank_2, index);
        if (HALFLIGHT_COLOR_BANK_3 != 0 && bank == 3) return texelFetch(color_bank_3, index);
    }
    return texelFetch(color_texels, index);
}

vec4 data_texel(int index) {
    if (HALFLIGHT_DATA_BANK_1 != 0) {
        int bank = index >> HALFLIGHT_DATA_BANK_SHIFT;
        index &= (1 << HALFLIGHT_DATA_BANK_SHIFT) - 1;
        if (bank == 1) return texelFetch(data_bank_1, index);
        if (HALFLIGHT_DATA_BANK_2 != 0 && bank == 2) return texelFetch(data_bank_2, index);
        if (HALFLIGHT_DATA_BANK_3 != 0 && bank == 3) return texelFetch(data_bank_3, index);
    }
    return texelFetch(data_texels, index);
}

// Returns a texel of a footprint: (256 high + low) / 65535 of its bytes if it is deep.
vec4 data_texel(TexelFootprint f, int corner) {
    precise vec4 value = data_texel(f.texel[corner]);
    if (kDeepTextures) {
        precise vec4 fine = (256.0 * value + data_texel(f.texel[corner] + (f.deep ? 1 : 0))) / 257.0;
        value = f.deep ? fine : value;
    }
    return value;
}

// Returns linear colour and alpha; 1 if the slot is empty.
vec4 color_texture(uint descriptor, vec2 uv0, vec2 uv1) {
    if (descriptor == kNoTexture) return vec4(1.0);
    TexelFootprint f = texture_footprint(descriptor, uv0, uv1, kColorTileShift);
    return blend_footprint(f, color_texel(f.texel.x), color_texel(f.texel.y), color_texel(f.texel.z),
                           color_texel(f.texel.w));
}

// Returns data in [0, 1]; 1 if the slot is empty.
vec4 data_texture(uint descriptor, vec2 uv0, vec2 uv1) {
    if (descriptor == kNoTexture) return vec4(1.0);
    TexelFootprint f = texture_footprint(descriptor, uv0, uv1, kDataTileShift);
    return blend_footprint(f, data_texel(f, 0), data_texel(f, 1), data_texel(f, 2), data_texel(f, 3));
}
