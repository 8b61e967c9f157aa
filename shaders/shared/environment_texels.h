// Environment: kUnitEnvironment holds the map times its colour. kUnitEnvironmentWarp (RGBA32F) holds
// the hierarchy that maps random numbers to directions (Clarberg et al. 2005, Wavelet Importance Sampling):
//
//   texel 0     columns and rows of cells (0: constant environment), probability of the environment in the alias table,
//               levels
//   texel 1     constant environment: its colour, and the illuminance of a surface in lux. Maps: the solid angle of a
//               cell over the sine of its middle's polar angle; first texels of the last level, of the level below the
//               blocks, and of the lobes
//   texel 2     number of levels above the blocks, columns and rows of the map, 0
//   from 3 on   per level, from one node down, and per node, row-major from the top: the weights of its children at the
//               upper left, upper right, lower left and lower right. All weights of a level add up to 1.
//   after that  per lobe: a texel with the illuminance of a surface in lux, then the levels above the blocks, with
//               weights times the cosine at the surface. Level k has 2^k x 2^k nodes here.
//
// A cell is a rectangle of equal extent in u and in v. If it is a texel, places in u and v within it follow the
// bilinear luminance; otherwise they are uniform. A node of level k covers 2^(levels - k) cells in each direction, less
// at the right and at the bottom. Children beyond the cells have the weight 0. Points that are stratified in the square
// stay stratified on the map.
//
// Blocks are the children of the last level that lobes have. A lobe belongs to a cell of kEnvironmentLobes^2 in an
// octahedral map of receivers' normals (Meyer et al. 2010); the last lobe belongs to receivers without a normal.
#pragma once

#include "shaders/shared/portable.h"

HALFLIGHT_SHARED_BEGIN

HALFLIGHT_SHARED_CONST int kEnvironmentFirstNode = 3;
HALFLIGHT_SHARED_CONST int kEnvironmentLobes = 12;
HALFLIGHT_SHARED_CONST int kEnvironmentLobeLevels = 5;  // maximum; blocks of 11 degrees

// Returns the texels of a lobe with `levels` levels: one, and 1 + 4 + ... + 4^(levels - 1).
HALFLIGHT_SHARED_FUNCTION int environment_lobe_texels(int levels) {
    return 1 + ((1 << (2 * levels)) - 1) / 3;
}

HALFLIGHT_SHARED_END
