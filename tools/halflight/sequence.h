// Sequences: `halflight render --frames`.
#pragma once

#include "tools/halflight/watch.h"

namespace halflight {

/// Renders the frames of the arguments, or checks them with --check. Throws Error if frames have failed, and
/// Interrupted after a signal, when all frames until then are written. watched: null without --watch.
void run_sequence(const RenderArguments& arguments, Watched* watched);

}  // namespace halflight
