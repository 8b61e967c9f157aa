#include "engine/io/gltf/extras.h"

#include <cmath>
#include <nlohmann/json.hpp>
#include <string>

#include "engine/core/error.h"
#include "engine/io/gltf/document.h"
#include "engine/scene/light_types.h"

namespace halflight {
namespace {

using Json = nlohmann::json;

std::optional<FrameRate> frame_rate(const Json& value) {
    if (!value.is_number()) return std::nullopt;
    try {
        // These digits distinguish rates like 23.976, and a float has no more.
        return parse_frame_rate("", fmt::format("{:.7g}", value.get<double>()));
    } catch (const Error&) {
        return std::nullopt;
    }
}

}  // namespace

std::optional<FrameRate> frame_rate_in_extras(const Json& root, GltfWarnings& warnings) {
    const double shown = root.contains("scene") && root["scene"].is_number() ? root["scene"].get<double>() : 0;
    const std::size_t scene = shown >= 0 && shown < 0x1p31 ? static_cast<std::size_t>(shown) : 0;
    const std::pair<Json::json_pointer, std::string> places[] = {
        {Json::json_pointer(fmt::format("/scenes/{}/extras", scene)), fmt::format("scenes[{}].extras", scene)},
        {Json::json_pointer("/asset/extras"), "asset.extras"},
    };
    for (const auto& [pointer, element] : places) {
        for (const char* const key : {"fps", "frame_rate"}) {
            if (!root.contains(pointer / key)) continue;
            if (const auto rate = frame_rate(root.at(pointer / key))) return rate;
            warnings.add(fmt::format("{} is no number of frames per second from 0.001 to 1000000; it is ignored", key),
                         element);
        }
    }
    return std::nullopt;
}

std::vector<Lens> lenses_in_extras(const Json& root, GltfWarnings& warnings) {
    constexpr double kMost = 1e9;
    struct Member {
        const char* key;
        double lower, upper;  // values that are accepted; 0 is, too
        void (*set)(Lens& lens, double value);
    };
    static constexpr Member kMembers[] = {
        {"aperture_fstop", 0.1, 1000, [](Lens& l, double v) { l.fstop = static_cast<float>(v); }},
        {"focus_distance", 1e-6, kMost,
         [](Lens& l, double v) {
             l.focus = {.kind = v > 0 ? Focus::Kind::distance : Focus::Kind::open, .distance = v};
         }},
        {"aperture_blades", 3, 64, [](Lens& l, double v) { l.blades = static_cast<int>(v); }},
        {"aperture_rotation", -kMost, kMost, [](Lens& l, double v) { l.rotation = glm::degrees(v); }},
        {"sensor_width", 0.1, 1000, [](Lens& l, double v) { l.sensor = v; }},
    };
    std::vector<Lens> lenses;
    const auto cameras = root.find("cameras");
    if (cameras == root.end() || !cameras->is_array()) return lenses;
    for (const Json& camera : *cameras) {
        Lens& lens = lenses.emplace_back();
        const auto extras = camera.is_object() ? camera.find("extras") : camera.end();
        if (extras == camera.end() || !extras->is_object()) continue;
        for (const Member& member : kMembers) {
            const auto found = extras->find(member.key);
            if (found == extras->end()) continue;
            const double value = found->is_number() ? found->get<double>() : NAN;
            if (value == 0 || (value >= member.lower && value <= member.upper))
                member.set(lens, value);
            else
                warnings.add(fmt::format("{} is neither 0 nor a number from {} to {}; it is ignored", member.key,
                                         member.lower, member.upper),
                             fmt::format("cameras[{}].extras", lenses.size() - 1));
        }
        if (!lens.blurs()) lens = {};
    }
    return lenses;
}

std::vector<LightSize> light_sizes_in_extras(const Json& root, GltfWarnings& warnings) {
    constexpr double kSunDistance = 149597870.7;  // km
    std::vector<LightSize> sizes;
    const Json::json_pointer place("/extensions/KHR_lights_punctual/lights");
    if (!root.contains(place) || !root.at(place).is_array()) return sizes;
    for (const Json& light : root.at(place)) {
        LightSize& size = sizes.emplace_back();
        if (!light.is_object() || !light.contains("extras") || !light["extras"].is_object()) continue;
        const bool directional = light.contains("type") && light["type"] == "directional";
        for (const char* const key : {"radius", directional ? "angle" : "shadow_soft_size"}) {
            const auto found = light["extras"].find(key);
            if (found == light["extras"].end()) continue;
            const bool is_angle = std::string_view(key) == "angle";
            const double most = is_angle ? double(kMostAngle) : double(kMostRadius);
            const double value = found->is_number() ? found->get<double>() : NAN;
            if (!(value >= 0 && value <= most))
                warnings.add(fmt::format("{} is no number from 0 to {:.4g}; it is ignored", key, most),
                             fmt::format("extensions.KHR_lights_punctual.lights[{}].extras", sizes.size() - 1));
            else if (directional)
                size.angle = static_cast<float>(is_angle ? value : 2 * std::atan(value / kSunDistance));
            else
                size.radius = static_cast<float>(value);
        }
        size.angle = std::min(size.angle, kMostAngle);
    }
    return sizes;
}

}  // namespace halflight
