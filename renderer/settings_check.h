// What makes sense to render.
#pragma once

#include "renderer/render.h"

namespace halflight {

/// Throw Error for settings out of range, in words for people.
void check_settings(const FrameSettings& frame, const Preview& preview);
void check_settings(const RenderSettings& settings);

}  // namespace halflight
