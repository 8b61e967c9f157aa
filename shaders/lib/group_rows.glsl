// Light of a path by light group: rows of vec4 at the path's index.
//   row 0             words: group of PathState::direct, group of the last light sample
//   rows 1 to G       rgb: parts of PathState::indirect
//   rows G+1 to 2G    rgb: parts of ReusePoint::light, with path reuse
// G is HALFLIGHT_LIGHT_GROUPS.
#include "shaders/shared/word.h"

const uint kGroupRows = 1u + uint(HALFLIGHT_LIGHT_GROUPS) * (HALFLIGHT_REUSE != 0 ? 2u : 1u);
const uint kOwnGroups = 1u;                            // first row of the path's own light
const uint kGivenGroups = 1u + uint(HALFLIGHT_LIGHT_GROUPS);  // first row of the light that it gives to others
