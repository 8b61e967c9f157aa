// Settings files that were saved for an earlier state of a scene.
#pragma once

#include <string>
#include <vector>

#include "engine/color/color.h"
#include "tools/cli/picture_arguments.h"

namespace halflight::view {

/// Leaves those entries of the settings file out of the arguments that do not suit the scene or the colour config, and
/// adds what is wrong with them to `problems`. Reads the scene without them. Does nothing if there is no settings
/// file, or if the arguments cannot be used without it either.
void leave_out_stale(PreviewArguments& arguments, const ColorConfig& colors, std::vector<std::string>& problems);

}  // namespace halflight::view
