// What a frame is asked for by the settings of a picture. Pure: no OpenGL.
#pragma once

#include "renderer/needs.h"
#include "renderer/render.h"

namespace halflight {

/// Of samples without the radiance cache. `settings` have a PrimaryVisibility that is not automatic, and an estimator
/// that leaves nothing open; `asked`: what it was before a pilot.
FrameOptions frame_options(const RenderSettings& settings, const Estimator& asked);

}  // namespace halflight
