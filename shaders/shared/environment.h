// Environment: UNIT_ENVIRONMENT holds the map times its colour (1x1: constant). UNIT_ENVIRONMENT_WARP (RGBA32F) holds
// the hierarchy that maps random numbers to directions (Clarberg et al. 2005, Wavelet Importance Sampling, section 4.1):
//
//   texel 0     columns and rows of cells (0: constant environment), probability of the environment among lights, levels
//   texel 1     the colour of a constant environment, 0; for maps: the index of the last level's first texel, the solid
//               angle of a cell over the sine of its middle's polar angle, 0, 0
//   from 2 on   per level, from one node down, and per node, row-major from the top: the weights of its children at the
//               upper left, upper right, lower left and lower right. All weights of a level add up to 1.
//
// A cell is a rectangle of equal extent in u and in v; directions within it are uniform per solid angle. A node of level
// k covers 2^(levels - k) cells in each direction, less at the right and at the bottom. Children beyond the cells have
// the weight 0. Points that are stratified in the square stay stratified on the map.
#ifndef HALFLIGHT_SHARED_ENVIRONMENT_H
#define HALFLIGHT_SHARED_ENVIRONMENT_H

#include "shaders/shared/portable.h"

HALFLIGHT_SHARED_BEGIN

HALFLIGHT_SHARED_CONST int kEnvironmentFirstNode = 2;

HALFLIGHT_SHARED_END

#endif
