// Texture descriptors (kUnitTextures, RGBA32UI): kTextureStride texels per use of an image.
//
//   texel 0   first texel in its pool, width, height, flags below
//   texel 1   transform: bits of m00, m01, m02 and 0, u = m00 s + m01 t + m02
//   texel 2   transform: bits of m10, m11, m12 and 0, v = m10 s + m11 t + m12
//
// Pools hold texels row-major, top row first: colour as linear half floats, everything else as 8-bit unorm.
//
// HALFLIGHT_TEXTURE_DEEP: some textures of data have 16 bits (kTextureDeep). Their texels take two places, or two columns
// of a tile: the four high bytes, then the four low ones.
//
// A pool with more texels than a texture buffer can address has several banks, texture buffers of 2^HALFLIGHT_COLOR_BANK_SHIFT or
// 2^HALFLIGHT_DATA_BANK_SHIFT texels each. HALFLIGHT_COLOR_BANK_n and HALFLIGHT_DATA_BANK_n tell whether bank n > 0
// exists.
//
// HALFLIGHT_TEXTURE_LEVELS: the descriptors of an image's mip levels follow each other, level 0 first.
//
// HALFLIGHT_TILED_TEXTURES: textures are cut into tiles, of which some are in the slots of one pool with two views
// (engine/paging/tile_pool.h). Component x of texel 0 is then the texture's first tile. Its tiles follow each other row
// by row. A table has the slot of each tile. Tiles of colour and of data take as many bytes, so data tiles are wider.
#pragma once

#include "shaders/shared/portable.h"

HALFLIGHT_SHARED_BEGIN

HALFLIGHT_SHARED_CONST int kTextureStride = 3;
HALFLIGHT_SHARED_CONST uint kNoTexture = 0x1fffffffu;  // value in place of a descriptor's index

HALFLIGHT_SHARED_CONST uint kMostBanks = 4u;
HALFLIGHT_SHARED_CONST uint kMostBankShift = 27u;

HALFLIGHT_SHARED_CONST int kTileRowShift = 5;    // logarithm of the rows of a tile
HALFLIGHT_SHARED_CONST int kColorTileShift = 5;  // logarithm of the columns of a tile of colour
HALFLIGHT_SHARED_CONST int kDataTileShift = 6;   // logarithm of the columns of a tile of data
// Slot of missing tiles. Its colours are 1, so that surfaces without tests of alpha stay opaque.
HALFLIGHT_SHARED_CONST uint kBlankSlot = 0u;
HALFLIGHT_SHARED_CONST uint kNoTile = 0xffffffffu;

HALFLIGHT_SHARED_CONST uint kWrapRepeat = 0u;  // values of Wrap in engine/scene/scene.h
HALFLIGHT_SHARED_CONST uint kWrapMirroredRepeat = 1u;
HALFLIGHT_SHARED_CONST uint kWrapClampToEdge = 2u;

HALFLIGHT_SHARED_CONST uint kTextureWrapMask = 3u;    // bits 0-1: wrap of u
HALFLIGHT_SHARED_CONST uint kTextureWrapVShift = 2u;  // bits 2-3: wrap of v
HALFLIGHT_SHARED_CONST uint kTextureNearest = 16u;
HALFLIGHT_SHARED_CONST uint kTextureUvSet1 = 32u;
HALFLIGHT_SHARED_CONST uint kTextureDeep = 64u;
HALFLIGHT_SHARED_CONST uint kTextureLastLevelShift = 8u;  // bits 8-12: number of the last mip level

HALFLIGHT_SHARED_END
