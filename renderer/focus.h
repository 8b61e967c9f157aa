// Focus on what a point of the picture shows.
#pragma once

#include "engine/color/color.h"
#include "engine/device/prepared_scene.h"
#include "engine/settings/render_settings.h"

namespace halflight {

/// Returns the distance, along the line of sight, of the surface at the camera's Focus::point, as a pinhole in the
/// place of the lens sees it. Returns infinity if there is none. The renderer makes a picture of one pixel through
/// that point, so geometry in pages, alpha and the pose on the device count. Throws Error as Renderer does.
double find_focus(PreparedScene& scene, const ColorConfig& colors, const RenderSettings& settings,
                  const Camera& camera);

}  // namespace halflight
