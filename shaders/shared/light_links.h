// Light links: the objects that each light lights, and those that cast its shadows (LightLinks in
// engine/scene/material.h).
//
// Rows (kUnitLightLinks, RGBA32UI):
//   texel 0       texel of the first classes, -, -, -
//   then          one texel per set of links: receivers, and blockers, one bit per class of objects, low word first. Set
//                 0 has all objects
//   then          classes of objects, one byte each: of the triangles of merged instances (0 for others), then of block
//                 instances (0 for the identity). The class of a surface is the larger one
// The set of a light stands in the table of light groups (kUnitLightGroups), above kLightGroupBits bits of the group.
#pragma once

#include "shaders/shared/portable.h"

HALFLIGHT_SHARED_BEGIN

HALFLIGHT_SHARED_CONST uint kLightGroupBits = 8u;
HALFLIGHT_SHARED_CONST uint kClassesPerTexel = 16u;

HALFLIGHT_SHARED_END
