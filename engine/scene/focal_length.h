// The focal length that a camera's field of view stands for.
#pragma once

#include "engine/scene/scene.h"

namespace halflight {

/// Returns the focal length of a perspective camera in millimetres: that of a lens focused at infinity with the
/// camera's sensor and field of view. aspect: width / height of the picture.
double focal_length(const Camera& camera, double aspect);

}  // namespace halflight
