// Checks of settings before rendering.
#pragma once

#include <string>

#include "engine/settings/render_settings.h"

namespace halflight {

/// Throws Error "render settings: ..." for settings that are out of range or contradict each other.
void check_settings(const RenderSettings& settings, bool checkpoint = false);
/// Checks the settings with those of another frame, which may have a checkpoint.
void check_settings(const RenderSettings& settings, const FrameSettings& frame, bool checkpoint);
/// Returns "cannot keep 'NAME'; ..." for the first name that is none of keepable_names(); empty where all are.
std::string kept_problem(const Kept& kept);

}  // namespace halflight
