// Constants of material rows. shaders/lib/material_properties.glsl lists the rows.
#pragma once

#include "shaders/shared/portable.h"

HALFLIGHT_SHARED_BEGIN

HALFLIGHT_SHARED_CONST float kAlphaBlend = -1.0f;  // alpha cutoff of materials that blend; 0: opaque

HALFLIGHT_SHARED_END
