#include "api/halflight/environment_choice.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <utility>
#include <vector>

#include "engine/core/error.h"
#include "engine/core/names.h"
#include "engine/core/suggestion.h"
#include "engine/tables/light_textures.h"

namespace halflight {
namespace {

/// The basic colours of CSS (CSS Color Module Level 4, section 6.1) that are useful as light.
constexpr std::pair<std::string_view, std::string_view> kColors[] = {
    {"black", "#000000"},  {"silver", "#c0c0c0"}, {"gray", "#808080"},  {"grey", "#808080"},
    {"white", "#ffffff"},  {"red", "#ff0000"},    {"green", "#008000"}, {"yellow", "#ffff00"},
    {"orange", "#ffa500"}, {"blue", "#0000ff"},   {"cyan", "#00ffff"},  {"magenta", "#ff00ff"}};

/// Parses numbers that are separated by commas.
std::optional<std::vector<double>> numbers(std::string_view text) {
    std::vector<double> values;
    const char *at = text.data(), *const last = text.data() + text.size();
    while (true) {
        const auto [end, error] = std::from_chars(at, last, values.emplace_back());
        if (error != std::errc() || !std::isfinite(values.back())) return std::nullopt;
        if (end == last) return values;
        if (*end != ',') return std::nullopt;
        at = end + 1;
    }
}

/// Parses "#rgb" or "#rrggbb", sRGB-encoded.
std::optional<vec3> hex_color(std::string_view text) {
    const std::size_t digits = text.size() == 4 ? 1 : 2;
    if (text.size() != 1 + 3 * digits) return std::nullopt;
    vec3 color;
    for (std::size_t c = 0; c < 3; ++c) {
        unsigned value = 0;
        const char* const first = text.data() + 1 + c * digits;
        const auto [end, error] = std::from_chars(first, first + digits, value, 16);
        if (error != std::errc() || end != first + digits) return std::nullopt;
        color[static_cast<int>(c)] =
            static_cast<float>(srgb_to_linear(static_cast<std::uint8_t>(digits == 1 ? 17 * value : value)));
    }
    return color;
}

}  // namespace

std::optional<vec3> color_of_text(std::string_view text) {
    if (text.starts_with('#')) return hex_color(text);
    for (const auto& [color, hex] : kColors)
        if (text == color) return hex_color(hex);
    return std::nullopt;
}

EnvironmentChoice parse_environment(const std::string& subject, const std::string& text) {
    if (text.empty()) throw Error(subject, "expects the name of a file, a colour or a preset");
    if (text == "none") return vec3(0);
    for (const SkyPreset preset : sky_presets())
        if (text == name(preset)) return preset;
    if (text == "grey" || text == "gray") return SkyPreset::overcast;
    if (const auto color = color_of_text(text)) return *color;
    if (text.starts_with('#')) throw Error(subject, "expects #rgb or #rrggbb, not '{}'", text);
    const auto values = numbers(text);
    if (values && values->size() == 3) {
        const dvec3 radiance((*values)[0], (*values)[1], (*values)[2]);
        if (glm::any(glm::lessThan(radiance, dvec3(0))))
            throw Error(subject, "expects no negative radiance, not '{}'", text);
        if (!all_finite(vec3(radiance))) throw Error(subject, "expects a radiance of at most 3e38, not '{}'", text);
        return vec3(radiance);
    }
    if (text.find_first_not_of("0123456789+-.,eE ") == std::string::npos)
        throw Error(subject, "expects the name of a file or R,G,B, not '{}'", text);
    if (text.find_first_of("./") == std::string::npos) {
        std::string presets;
        std::vector<std::string> names = {"none"};
        for (const auto& [color, hex] : kColors) names.emplace_back(color);
        for (const SkyPreset preset : sky_presets()) {
            presets += fmt::format(", {}", name(preset));
            names.emplace_back(name(preset));
        }
        throw Error(subject, "expects a file, a colour, none{}, not '{}'{}", presets, text, did_you_mean(text, names));
    }
    return std::filesystem::path(text);
}

ClearSky parse_clear_sky(const std::string& subject, const std::string& text) {
    const auto values = numbers(text);
    if (!values || values->size() < 2 || values->size() > 5)
        throw Error(subject, "expects ELEVATION,AZIMUTH[,TURBIDITY[,ALBEDO[,ALTITUDE]]], not '{}'", text);
    ClearSky sky;
    double* const members[] = {&sky.elevation, &sky.azimuth, &sky.turbidity, &sky.ground_albedo, &sky.altitude};
    for (std::size_t i = 0; i < values->size(); ++i) *members[i] = (*values)[i];
    const auto check = [&](const char* what, double value, double lower, double upper) {
        if (!(value >= lower && value <= upper))
            throw Error(subject, "expects {} from {} to {}, not '{}'", what, lower, upper, text);
    };
    check("an elevation", sky.elevation, kLeastElevation, 90);
    check("an azimuth", sky.azimuth, -360, 360);
    check("a turbidity", sky.turbidity, kLeastTurbidity, kMostTurbidity);
    check("a ground albedo", sky.ground_albedo, 0, 1);
    check("an altitude", sky.altitude, 0, kMostAltitude);
    return sky;
}

std::string text(const ClearSky& sky) {
    return fmt::format("{},{},{},{},{}", sky.elevation, sky.azimuth, sky.turbidity, sky.ground_albedo, sky.altitude);
}

}  // namespace halflight
