// The paths of a batch: all of them, or with HALFLIGHT_LIST those of a list. This file binds the list.
#include "shaders/shared/ray_structs.h"

const bool kListed = HALFLIGHT_LIST != 0;
OPTIONAL(HALFLIGHT_LIST) layout(std430) readonly buffer List { uint list[]; };
OPTIONAL(HALFLIGHT_LIST) layout(std430) readonly buffer Header { ListHeader header; };
uniform uint capacity;  // without a list: number of paths

uint entry_count() { return kListed ? header.count : capacity; }
uint path_of(uint entry) { return kListed ? list[entry] : entry; }
