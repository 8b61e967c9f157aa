// Framing of a part of a scene; framing_camera() in scene.h frames all of it.
#pragma once

#include "engine/scene/scene.h"

namespace halflight {

/// Returns framing_camera() of a box. Precondition: the box is not empty.
Camera framing_camera(const WorldBounds& box, double aspect, bool turns);

}  // namespace halflight
