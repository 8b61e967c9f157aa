// What preview modes have in common: when they end, and what their texels mean at the borders.
#ifndef HALFLIGHT_SHARED_PREVIEW_H
#define HALFLIGHT_SHARED_PREVIEW_H

#include "shaders/shared/portable.h"

HALFLIGHT_SHARED_BEGIN

// Samples of a picture from which on nothing of earlier pictures is in it; they fade out linearly until then.
HALFLIGHT_SHARED_CONST float kTemporalEnds = 32.0f;
// Samples that earlier pictures count for at most: what they tell is old.
HALFLIGHT_SHARED_CONST float kMostHistory = 32.0f;
// Samples of a picture from which on its noise is filtered less and less, and not at all.
HALFLIGHT_SHARED_CONST float kFilterWeakens = 64.0f;
HALFLIGHT_SHARED_CONST float kFilterEnds = 256.0f;
// Light is looked at over the albedo, which counts for so much at least: black surfaces reflect little, not nothing.
HALFLIGHT_SHARED_CONST float kLeastAlbedo = 0.01f;

// Counts of texels of earlier pictures that were refused.
HALFLIGHT_SHARED_CONST uint kRefusedNan = 0u;
HALFLIGHT_SHARED_CONST uint kRefusedInfinite = 1u;
HALFLIGHT_SHARED_CONST uint kRefusedKinds = 2u;

HALFLIGHT_SHARED_END

#endif
