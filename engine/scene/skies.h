// Environments that the engine generates: neutral light for objects, a studio, a clear sky with its sun, an overcast
// sky.
#pragma once

#include <optional>
#include <span>
#include <string_view>

#include "engine/scene/scene.h"

namespace halflight {

/// A clear sky, computed by Atmosphere.
struct ClearSky {
    double elevation = 45;       // sun above the horizon, degrees, [kLeastElevation, 90]
    double azimuth = 0;          // sun, degrees clockwise from north as seen from above; north is -Z, east +X
    double turbidity = 3;        // haze: 1 none, 2 clear, 6 hazy; from kLeastTurbidity to kMostTurbidity
    double ground_albedo = 0.2;  // [0, 1]
    double altitude = 0;         // height of the eye above the sea, metres, [0, kMostAltitude]
    bool operator==(const ClearSky&) const = default;
};
inline constexpr double kLeastElevation = -18;  // end of the twilight
inline constexpr double kLeastTurbidity = 1, kMostTurbidity = 10, kMostAltitude = 10000;

/// A generated environment, and its sun if it has one.
struct Sky {
    Environment environment;
    std::optional<PunctualLight> sun{};  // a directional light with PunctualLight::of_environment
};

/// Returns the sky in nits and its sun in lux. The sun is a directional light of 0.53 degrees, and the map does not
/// contain its disc; below the horizon there is none. Below the horizon, the map shows the ground through
/// the air before it. A clear night without moon adds 2.5e-4 nits.
Sky clear_sky(const ClearSky& sky);

enum class SkyPreset { neutral, studio, sky, overcast };
std::span<const SkyPreset> sky_presets();
const char* name(SkyPreset preset);
/// Azimuth of the camera that framing_camera() returns, degrees from +Z to +X.
inline constexpr double kFramingAzimuth = 30;
/// Returns the azimuth of the point of view of a camera, degrees from +Z to +X. A camera that looks straight down or up
/// has that of its picture's lower or upper edge. It is rounded to 1e-6, so that cameras that differ by the rounding of
/// their numbers have the same light.
double view_azimuth(const Camera& camera);
/// Returns a generated environment. All give a horizontal surface an irradiance of about pi, so that a white floor has
/// radiance 1.
///   - neutral: grey light that shows the form of objects. A key on the left of a camera of that azimuth and a weaker
///     fill on the right are brighter than what is between them; boxes behind the object light its outline. The ground
///     becomes darker towards the nadir. The mean radiance is that of overcast.
///   - studio: soft boxes in front of grey.
///   - sky: a clear sky with its sun.
///   - overcast: default_sky().
Sky preset_sky(SkyPreset preset, double azimuth = kFramingAzimuth);

}  // namespace halflight
