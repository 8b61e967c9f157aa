// The choice of an environment, and its form as text.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include "engine/scene/skies.h"

namespace halflight {

/// Requested environment: unspecified, a constant radiance (linear Rec.709), the file of a map (.exr, .hdr), a
/// generated environment, or a clear sky in nits. If unspecified, a scene gets a neutral sky if its own light is
/// negligible (docs/light.md).
using EnvironmentChoice = std::variant<std::monostate, vec3, std::filesystem::path, SkyPreset, ClearSky>;

/// Parses a value of --env:
///   - "none", or the name of a preset; "grey" and "gray" mean overcast, an even light;
///   - a colour: "R,G,B" is a linear radiance, "#rgb", "#rrggbb" and names such as "white" are sRGB-encoded;
///   - the name of a file.
/// Throws Error about `subject` for malformed colours and negative radiances.
EnvironmentChoice parse_environment(const std::string& subject, const std::string& text);

/// Returns the linear radiance of "#rgb", "#rrggbb" or the name of a colour; none for other texts.
std::optional<vec3> color_of_text(std::string_view text);

/// Parses "ELEVATION,AZIMUTH[,TURBIDITY[,ALBEDO[,ALTITUDE]]]". Throws Error about `subject`.
ClearSky parse_clear_sky(const std::string& subject, const std::string& text);
/// Returns "ELEVATION,AZIMUTH,TURBIDITY,ALBEDO,ALTITUDE", from which parse_clear_sky() restores the value exactly.
std::string text(const ClearSky& sky);

}  // namespace halflight
