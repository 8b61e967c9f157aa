// Frame options from the settings of a picture. Pure: no OpenGL.
#pragma once

#include "renderer/needs.h"
#include "renderer/render.h"

namespace halflight {

/// Returns the options of samples without the radiance cache. The settings' primary visibility must not be automatic,
/// and their estimator must leave nothing open. asked: the estimator before a pilot settled it.
FrameOptions frame_options(const RenderSettings& settings, const Estimator& asked);

}  // namespace halflight
