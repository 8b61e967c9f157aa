// Metering: the exposure of display images, from a small picture of the scene that is made before the first one.
#pragma once

#include <optional>

#include "engine/color/color.h"
#include "engine/device/prepared_scene.h"
#include "renderer/pilot.h"
#include "renderer/render.h"

namespace halflight {

inline constexpr float kNearStops = 3;  ///< pictures whose exposure would be smaller are not changed

/// Returns the exposure of a linear picture in stops, a multiple of 0.01: 0 if the picture is black, or if the
/// exposure would be below kNearStops either way.
///
/// The logarithm of the luminance is averaged over the pixels between the 20th and the 95th percentile, black pixels
/// left out. Pixels at the centre of each eye's picture weigh ten times as much as those in the corners; those of
/// panoramas also weigh by their solid angle. The mean becomes 0.18, the reflectance of a grey card, unless the 95th
/// percentile would become more than 4.
float metered_exposure(const Image& picture, const Optics& optics = {});

/// Returns the exposure of the settings' camera in the current pose of the scene, by a picture of about kMeterPixels
/// pixels and kMeterSamples samples. Returns none if `progress` has cancelled. Throws Error as Renderer does.
std::optional<float> find_exposure(PreparedScene& scene, const ColorConfig& colors, const RenderSettings& settings,
                                   const PilotProgress& progress = {});
inline constexpr double kMeterPixels = 64 * 36;
inline constexpr int kMeterSamples = 4;

}  // namespace halflight
