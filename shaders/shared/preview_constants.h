// Constants shared by the preview modes: their ends, and the meaning of texels at borders.
#pragma once

#include "shaders/shared/portable.h"

HALFLIGHT_SHARED_BEGIN

// Number of samples from which on a picture contains nothing of earlier pictures; they fade out linearly until then.
HALFLIGHT_SHARED_CONST float kTemporalEnds = 32.0f;
// Maximum number of samples that earlier pictures count for, because they are outdated.
HALFLIGHT_SHARED_CONST float kMostHistory = 32.0f;
// Numbers of samples at which filtering starts to fade out, and at which it ends.
HALFLIGHT_SHARED_CONST float kFilterWeakens = 64.0f;
HALFLIGHT_SHARED_CONST float kFilterEnds = 256.0f;

// Counters of rejected texels of earlier pictures.
HALFLIGHT_SHARED_CONST uint kRefusedNan = 0u;
HALFLIGHT_SHARED_CONST uint kRefusedInfinite = 1u;
HALFLIGHT_SHARED_CONST uint kRefusedKinds = 2u;

HALFLIGHT_SHARED_END
