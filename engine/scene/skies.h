// Environments that the engine generates: a clear sky with its sun, an overcast sky, a studio.
#pragma once

#include <optional>
#include <span>
#include <string_view>

#include "engine/scene/scene.h"

namespace halflight {

/// A clear sky by Preetham, Shirley, Smits 1999 (A Practical Analytic Model for Daylight).
struct ClearSky {
    double elevation = 45;  // sun above the horizon, degrees, [0, 90]
    double azimuth = 0;     // sun, degrees clockwise from north as seen from above; north is -Z, east +X
    double turbidity = 3;   // haze: 2 clear, 6 hazy; from kLeastTurbidity to kMostTurbidity
    bool operator==(const ClearSky&) const = default;
};
inline constexpr double kLeastTurbidity = 2, kMostTurbidity = 10;

/// A generated environment, and its sun where it has one.
struct Sky {
    Environment environment;
    std::optional<PunctualLight> sun{};  // a directional light with PunctualLight::of_environment
};

/// Returns the sky of the model's appendix A.2 in nits and its sun in lux. The sun's extinction is that of section 3.1
/// by Rayleigh scattering and aerosols, at one wavelength per channel; ozone, mixed gases and water vapour are left
/// out. The sun is a directional light, so its shadows have sharp edges. Below the horizon, grey ground of albedo 0.2
/// reflects the light of both. The model is made for turbidities of 2 to 6 and for a sun above 5 degrees.
Sky clear_sky(const ClearSky& sky);

enum class SkyPreset { studio, sky, overcast };
std::span<const SkyPreset> sky_presets();
const char* name(SkyPreset preset);
/// Returns a generated environment. All give a horizontal surface an irradiance of about pi, so that a white floor has
/// radiance 1. studio: soft boxes in front of grey; sky: a clear sky with its sun; overcast: default_sky().
Sky preset_sky(SkyPreset preset);

}  // namespace halflight
