// Light of a path by light group: rows of vec4 at the path's index.
//   row 0             words: group of PathState::direct, group of the last light sample
//   rows 1 to G       rgb: parts of PathState::indirect
//   rows G+1 to 2G    rgb: parts of ReusePoint::light, with path reuse
// G is HALFLIGHT_LIGHT_GROUPS.
#include "shaders/shared/word.h"

#if HALFLIGHT_REUSE
const uint kGroupRows = 1u + 2u * HALFLIGHT_LIGHT_GROUPS;
#else
const uint kGroupRows = 1u + HALFLIGHT_LIGHT_GROUPS;
#endif
const uint kOwnGroups = 1u;                            // first row of the path's own light
const uint kGivenGroups = 1u + HALFLIGHT_LIGHT_GROUPS;  // first row of the light that it gives to others
