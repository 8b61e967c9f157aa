// Checks of settings before rendering.
#pragma once

#include <string>

#include "engine/settings/constraints.h"

namespace halflight {

/// Throws Error "render settings: ..." for settings that are out of range or cannot be combined (constraints.h).
void check_settings(const RenderSettings& settings, const Occasion& occasion = {});
/// Checks the settings with those of another frame.
void check_settings(const RenderSettings& settings, const FrameSettings& frame, const Occasion& occasion);
/// Returns "cannot keep 'NAME'; ..." for the first name that is none of keepable_names(); empty if all are.
std::string kept_problem(const Kept& kept);

}  // namespace halflight
