// Environment: UNIT_ENVIRONMENT holds the map times its colour (1x1: constant), UNIT_ENVIRONMENT_ALIAS (RGBA32F) its
// importance:
//
//   texel 0     columns and rows of the table (0: constant environment), probability of the environment among lights, 0
//   texel 1     the colour of a constant environment, 0
//   from 2 on   per cell, row-major from the top: alias threshold, alias (a word, word.h), density of this cell,
//               density of the alias. Densities are per solid angle and include the probability in texel 0.
//
// A cell is a rectangle of equal extent in u and in v; directions within it are uniform per solid angle.
#ifndef HALFLIGHT_SHARED_ENVIRONMENT_H
#define HALFLIGHT_SHARED_ENVIRONMENT_H

#include "shaders/shared/portable.h"

HALFLIGHT_SHARED_BEGIN

HALFLIGHT_SHARED_CONST int kEnvironmentFirstCell = 2;

HALFLIGHT_SHARED_END

#endif
