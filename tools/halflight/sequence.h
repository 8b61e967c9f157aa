// Frames of a sequence: which are to be made, making them, and what became of them.
#pragma once

#include "tools/halflight/arguments.h"

namespace halflight {

/// Makes the frames that are not there yet, in the order asked for. Where one fails the others go on, and an Error that
/// names those that failed comes at the end. A frame that is there whole and has the fingerprint that it would get is
/// kept; one of another fingerprint is an Error before anything is rendered, unless arguments.overwrite says so; one
/// that is damaged is made again. With arguments.check none is made, and an Error names those that are not there whole
/// with that fingerprint. Throws Interrupted after a signal, with all frames up to then written.
void run_sequence(const RenderArguments& arguments);

}  // namespace halflight
