// Constants of the denoiser and of the filter of previews (passes/picture/denoiser.h).
#pragma once

#include "shaders/shared/portable.h"

HALFLIGHT_SHARED_BEGIN

// Number of doubles per path in Accumulated::halves.
HALFLIGHT_SHARED_CONST uint kHalfSums = 13u;
// Number of its leading doubles that are sums over the first half of the samples.
HALFLIGHT_SHARED_CONST uint kFirstHalfSums = 9u;
// Depths along the camera's axis count as at least this value, world units, because their logarithm is averaged.
HALFLIGHT_SHARED_CONST float kLeastDepth = 1e-20f;
// Light is filtered divided by the albedo, which counts as at least this value: black surfaces reflect little, not
// nothing.
HALFLIGHT_SHARED_CONST float kLeastFilteredAlbedo = 1e-4f;
// Largest light over albedo that is filtered. Sums of such values are finite.
HALFLIGHT_SHARED_CONST float kMostFilteredLight = 1e36f;
// Lower bound of sums of weights, which keeps quotients finite.
HALFLIGHT_SHARED_CONST float kLeastReach = 1e-6f;
// Light over albedo that counts as dark, and lower bound of sums of weights that are such light.
HALFLIGHT_SHARED_CONST float kLeastLight = 1e-20f;
// Largest value that is squared. Sums of such squares are finite.
HALFLIGHT_SHARED_CONST float kMostSquared = 1e15f;

HALFLIGHT_SHARED_END
