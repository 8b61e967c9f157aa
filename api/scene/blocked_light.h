// Warnings about lights of little size that glass hides from the surfaces that cameras see.
#pragma once

#include <string>
#include <vector>

#include "engine/rays/scene_probe.h"
#include "engine/scene/scene.h"

namespace halflight {

/// Returns a line for each point, spot or directional light that reaches a tenth or more of the visible surfaces before
/// it only through glass that hides it (rays::hides_points()). Shadow rays end there, and paths meet a light without
/// size never and one of little size rarely, so the pictures lack its light or have it in speckles. Asks the first 64
/// lights and the first 4 cameras, by 144 points for each camera. Without cameras, the default camera is asked.
std::vector<std::string> blocked_lights(const rays::LazyProbe& probe, const Scene& scene,
                                        const std::vector<Camera>& cameras);

}  // namespace halflight
