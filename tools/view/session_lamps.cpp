// Lamps that are added, duplicated and removed in a session.
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>

#include "api/halflight/edit_text.h"
#include "api/halflight/object_names.h"
#include "engine/core/error.h"
#include "tools/view/session.h"

namespace halflight::view {
namespace {

/// Returns a number rounded to about three digits of `scale`, so that settings files are easy to read.
double rounded(double value, double scale) {
    const double step = std::pow(10, std::floor(std::log10(scale)) - 2);
    return std::round(value / step) * step;
}

dvec3 rounded(const dvec3& value, double scale) {
    return {rounded(value.x, scale), rounded(value.y, scale), rounded(value.z, scale)};
}

/// Returns a name that an added lamp can have: without signs that have a meaning in lists and patterns.
std::string usable_name(std::string name, LampKind kind) {
    for (char& c : name)
        if (c == '*' || c == '?' || c == ',' || std::iscntrl(static_cast<unsigned char>(c)) != 0) c = '_';
    return name.find_first_not_of("0123456789") == std::string::npos ? halflight::name(kind) : name;
}

}  // namespace

std::string Session::free_lamp_name(std::string name) const {
    const std::size_t end = name.find_last_not_of("0123456789");  // of "spot 2"
    if (end != std::string::npos && end > 0 && end + 1 < name.size() && name[end] == ' ') name.resize(end);
    for (int number = 1;; ++number) {
        const std::string candidate = number == 1 ? name : fmt::format("{} {}", name, number);
        if (std::ranges::find(lights(), candidate, &PunctualLight::name) == lights().end()) return candidate;
    }
}

void Session::add_lamp(LampKind kind, const dvec2& point, const ivec2& size) {
    constexpr double kShare = 0.4;  // distance of the lamp from the surface, as a share of that of the camera
    constexpr double kRoom = 0.8;   // and at most this share of the way to the next surface
    const auto picked = pick(point, size);
    const dvec3 lit = picked ? picked->position : pose_.at;
    const dvec3 back = camera().orthographic ? dvec3(camera().camera_to_world[2]) * diagonal_ : pose_.from - lit;
    const dvec3 away = glm::normalize(glm::normalize(back) + dvec3(0, 0.7, 0));  // above the camera's way
    double distance = kShare * glm::length(back);
    if (!pages_) {
        const auto above = picker().pick({lit + 1e-3 * distance * away, away});
        if (above) distance = std::min(distance, kRoom * glm::distance(above->position, lit));
    }
    SceneEdits other = edits;
    AddedLamp& lamp = other.added_lights.emplace_back(AddedLamp{free_lamp_name(name(kind)), kind});
    const double irradiance = kPi * std::exp2(-double{transform.stops()});  // of a white surface that is shown as 1
    double intensity = irradiance;
    if (kind != LampKind::sun) {
        lamp.edit.position = rounded(lit + distance * away, distance);
        intensity *= distance * distance;
    }
    if (kind != LampKind::point) lamp.edit.direction = unit_direction(rounded(-away, 1));
    if (is_area(kind)) {
        const double side = rounded(0.5 * distance, distance),
                     area = side * side * (kind == LampKind::disc ? kPi / 4 : 1);
        lamp.edit.size = vec2(static_cast<float>(side));
        intensity /= area;
    } else if (kind == LampKind::sun) {
        lamp.edit.angle = 0.53f;
    } else {
        lamp.edit.radius = static_cast<float>(rounded(0.02 * distance, 0.02 * distance));
    }
    if (kind == LampKind::spot) lamp.edit.inner = 20.0f, lamp.edit.outer = 30.0f;
    lamp.edit.intensity = static_cast<float>(std::min(rounded(intensity, intensity), kEditIntensity.upper));
    const std::string added = lamp.name;
    edit(std::move(other));
    select("light:" + added);
}

void Session::duplicate_lamp() {
    if (selection.kind != ObjectKind::light) throw Error("duplicate", "no light is selected");
    const SceneEdits now = edits_now();
    AddedLamp lamp;
    if (added_lamp(selection.index)) {
        lamp = *lamps_in_order(now).at(selection.index - scene_->lights.size());
        lamp.name = free_lamp_name(lamp.name);
    } else {
        const PunctualLight& source = scene_->lights[selection.index];
        const bool sun = source.type == LightType::directional;
        lamp.kind = sun ? LampKind::sun : source.type == LightType::spot ? LampKind::spot : LampKind::point;
        lamp.name = free_lamp_name(usable_name(source.name, lamp.kind));
        // Patterns that match the copy's name apply to it, so that its own values must not have them.
        const Scene values = edited_values(lamp.name);
        const PunctualLight& light = values.lights.at(selection.index);
        const LightEdit* const own = find_light_edit(now, references().lights[selection.index]);
        if (light.profile != kNone) {
            lamp.edit.ies = values.light_profiles.at(static_cast<std::size_t>(light.profile)).path;
            if (lamp.edit.ies.empty())
                throw Error(light.name, "has a light profile of the scene's file, which a copy cannot have");
        }
        const LightColor color = color_of(light);
        lamp.edit.intensity = color.intensity;
        if (color.color != vec3(1)) lamp.edit.color = color.color;
        if (sun) {
            lamp.edit.angle = std::min(glm::degrees(light.angle), static_cast<float>(kEditAngle.upper));
        } else {
            lamp.edit.position = light.position;
            lamp.edit.radius = light.radius;
        }
        if (light.type != LightType::point || light.profile != kNone)
            lamp.edit.direction = unit_direction(dvec3(light.direction));
        if (light.type == LightType::spot) {
            lamp.edit.inner = glm::degrees(light.inner_cone);
            lamp.edit.outer = std::min(glm::degrees(light.outer_cone), static_cast<float>(kEditCone.upper));
        }
        if (own && own->off) lamp.edit.off = true, lamp.edit.intensity = own->intensity;
    }
    if (lamp.edit.position) {
        const dvec3 right(camera().camera_to_world[0]);
        const double aside = 0.1 * glm::distance(*lamp.edit.position, pose_.from);
        lamp.edit.position = glm::clamp(*lamp.edit.position + aside * right, kEditPosition.lower, kEditPosition.upper);
    }
    SceneEdits other = edits;
    const std::string added = lamp.name;
    other.added_lights.push_back(std::move(lamp));
    edit(std::move(other));
    select("light:" + added);
}

bool Session::remove_lamp() {
    const AddedLamp* const lamp = selection.kind == ObjectKind::light ? added_lamp(selection.index) : nullptr;
    if (!lamp) return false;
    const std::string name = lamp->name;
    SceneEdits other = edits;
    EditKeys keys = arguments_.choice.keys;
    std::erase_if(other.added_lights, [&](const AddedLamp& one) { return one.name == name; });
    const auto names_it = [&](const std::string& of) { return of == name || of == "light:" + name; };
    std::erase_if(other.hidden, [&](const ObjectName& hidden) { return names_it(hidden.name); });
    for (auto* const links : {&other.light_links, &other.shadow_links})
        std::erase_if(*links, [&](const LightLink& link) { return names_it(link.light); });
    for (LightGroup& group : other.light_groups) std::erase_if(group.lights, names_it);
    std::erase_if(other.light_groups, [](const LightGroup& group) { return group.lights.empty(); });
    std::erase_if(keys.tracks, [&](const EditTrack& track) {
        return (track.of == EditTrack::Of::lights && track.name == name) ||
               (track.of == EditTrack::Of::hide && names_it(track.name));
    });
    check_keyed(other, keys);
    edit(std::move(other));
    take_keys(std::move(keys));
    selection = {};
    return true;
}

}  // namespace halflight::view
