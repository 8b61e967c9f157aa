// Checks of settings before rendering.
#pragma once

#include "engine/settings/render_settings.h"

namespace halflight {

/// Throws Error "render settings: ..." for settings that are out of range or contradict each other.
void check_settings(const RenderSettings& settings);
/// Checks the settings with those of another frame.
void check_settings(const RenderSettings& settings, const FrameSettings& frame);

}  // namespace halflight
