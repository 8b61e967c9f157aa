// `--camera all`: one picture or sequence for each camera of the scene.
#pragma once

#include <vector>

#include "tools/halflight/arguments.h"

namespace halflight {

/// Returns the arguments of each camera, whose name is part of the names of files: in place of {camera}, else before
/// the first dot: shot.exr becomes shot.CAMERA.exr. If the arguments ask for a single camera, they are returned
/// alone, with its name in place of {camera}. Throws Error for scenes without such cameras and for names that are
/// equal.
std::vector<RenderArguments> arguments_by_camera(const RenderArguments& arguments);

}  // namespace halflight
