// The properties of lights and of the environment.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "api/halflight/edit_text.h"
#include "engine/core/error.h"
#include "engine/core/names.h"
#include "engine/scene/black_body.h"
#include "engine/scene/light_types.h"
#include "tools/view/inspector.h"
#include "tools/view/outliner.h"
#include "tools/view/widgets.h"

namespace halflight::view {
namespace {

/// Returns the temperature of the black body whose colour is nearest.
float kelvin_of(const vec3& color) {
    const float most = std::max({color.r, color.g, color.b});
    const vec3 hue = most > 0 ? color / most : vec3(1);
    return static_cast<float>(std::round(nearest_black_body(hue, kEditTemperature.lower, double{kMostKelvin})));
}

/// Returns the intensity of a light with its own edit, before the factor. `values` have all edits.
float intensity_of(const Scene& values, const PunctualLight& own, const LightEdit& edit) {
    const float intensity = color_of(own).intensity;
    const LightProfile* const profile = edit.ies.empty() ? nullptr : profile_of_file(values, edit.ies);
    return edit.intensity.value_or(profile && intensity > 0 ? profile->candela : intensity);
}

void color_of_light(const PunctualLight& shown, LightEdit& edit) {
    if (radio("Colour RGB", !edit.temperature, "the colour is given by its channels") && edit.temperature) {
        edit.color = color_of(shown).color;
        edit.temperature.reset();
    }
    if (radio("Kelvin", edit.temperature.has_value(), "the colour is that of a black body", true) && !edit.temperature)
        edit.temperature = kelvin_of(edit.color.value_or(color_of(shown).color)), edit.color.reset();
    if (edit.temperature) {
        slider("Temperature", *edit.temperature, static_cast<float>(kEditTemperature.lower), kMostKelvin, "%.0f K",
               "colour of a black body: 2700 is a warm lamp, 6500 daylight", kClamp);
        return;
    }
    vec3 color = edit.color.value_or(color_of(shown).color);
    if (pick_color("Colour", color, "linear Rec.709; white has the intensity of the strongest channel"))
        edit.color = color;
}

void direction_of_light(const PunctualLight& shown, LightEdit& edit) {
    // The angles point towards the source. The zenith is excluded, because the azimuth would be lost there.
    const dvec3 back = -glm::normalize(edit.direction.value_or(dvec3(shown.direction)));
    vec2 angles(glm::degrees(std::atan2(back.x, -back.z)), glm::degrees(std::asin(std::clamp(back.y, -1.0, 1.0))));
    bool changed =
        slider("Azimuth", angles.x, -180, 180, "%.1f deg", "direction towards the source, clockwise from north (-Z)");
    changed |=
        slider("Elevation", angles.y, -89.9f, 89.9f, "%.1f deg", "direction towards the source, above the horizon");
    if (!changed) return;
    const dvec2 a = glm::radians(dvec2(angles));
    edit.direction = -dvec3(std::cos(a.y) * std::sin(a.x), std::sin(a.y), -std::cos(a.y) * std::cos(a.x));
}

/// Shows the profile of a point or spot, and lets the user choose another one.
void profile_of_light(PanelContext& c, const Scene& values, const PunctualLight& shown, const AddedLamp* added,
                      LightEdit& edit) {
    if (shown.type == LightType::directional) return;
    if (shown.profile != kNone)
        value("Profile", values.light_profiles.at(static_cast<std::size_t>(shown.profile)).name);
    if (button("Profile ...", "replaces the distribution of the light by that of an IES file"))
        c.requests.ask_profile = true;
    if (edit.ies.empty() || !button("Remove profile", "restores the distribution of the light without it")) return;
    edit.ies.clear();
    if (added && added->kind == LampKind::point) edit.direction.reset();  // which points do not have
}

/// Shows the width and height of a rectangle, or the diameter of a disc.
void size_of_area(const AreaLamp& lamp, float diagonal, LightEdit& edit) {
    vec2 size = lamp.size;
    const auto side = [&](const char* name, float& value) {
        return slider(name, value, static_cast<float>(kEditSize.lower), diagonal, "%.3f m", "size of the surface",
                      kLogarithmic | kClamp);
    };
    bool changed = side(lamp.disc ? "Diameter" : "Width", size.x);
    if (lamp.disc)
        size.y = size.x;
    else
        changed |= side("Height", size.y);
    if (changed) edit.size = size;
}

/// Shows the cone of a spot. Its angles push each other, so that the inner one stays the smaller.
void cone_of_spot(const PunctualLight& shown, LightEdit& edit) {
    constexpr float kLeast = 0.1f;  // degrees between them
    const auto most = static_cast<float>(kEditCone.upper);
    float inner = glm::degrees(shown.inner_cone), outer = std::min(glm::degrees(shown.outer_cone), most);
    if (slider("Inner", inner, 0, most - kLeast, "%.1f deg",
               "angle from the direction at which the light begins to fall")) {
        edit.inner = inner;
        if (outer < inner + kLeast) edit.outer = inner + kLeast;
    }
    if (slider("Outer", outer, kLeast, most, "%.1f deg", "angle from the direction at which the light ends")) {
        edit.outer = outer;
        if (inner > outer - kLeast) edit.inner = std::max(outer - kLeast, 0.0f);
    }
}

void size_of_light(const PunctualLight& shown, float diagonal, LightEdit& edit) {
    if (shown.type == LightType::directional) {
        float angle = glm::degrees(shown.angle);
        if (slider("Angle", angle, 0, static_cast<float>(kEditAngle.upper), "%.2f deg",
                   "diameter in the sky: 0.53 is the sun, more is softer shadows", kLogarithmic | kClamp))
            edit.angle = angle;
        return;
    }
    float radius = shown.radius;
    if (slider("Radius", radius, 0, diagonal, "%.3f m", "radius of the lamp: more is softer shadows",
               kLogarithmic | kClamp))
        edit.radius = radius;
}

/// Lets the user type which objects a light is linked to. Texts that name nothing are reported and not taken. Lists
/// that the field cannot hold are only shown.
void link_of_light(PanelContext& c, const char* name, const char* help, const std::string& light,
                   std::vector<LightLink> SceneEdits::*links) {
    const std::vector<LightLink>& now = c.session.edits.*links;
    const auto own = std::ranges::find(now, light, &LightLink::light);
    const std::string shown = own == now.end() ? "" : fmt::format("{}", fmt::join(own->objects, ","));
    std::array<char, 1024> typed{};
    shown.copy(typed.data(), typed.size() - 1);
    const auto has_comma = [](const std::string& object) { return object.find(',') != std::string::npos; };
    const bool is_shown_only =
        own != now.end() && (shown.size() >= typed.size() || std::ranges::any_of(own->objects, has_comma));
    label(name, help);
    const bool entered =
        ImGui::InputText(fmt::format("##{}", name).c_str(), typed.data(), typed.size(),
                         ImGuiInputTextFlags_EnterReturnsTrue | ImGuiInputTextFlags_AutoSelectAll |
                             (is_shown_only ? ImGuiInputTextFlags_ReadOnly : ImGuiInputTextFlags_None));
    if (!entered || is_shown_only) return;
    SceneEdits edits = c.session.edits;
    std::erase_if(edits.*links, [&](const LightLink& link) { return link.light == light; });
    const std::string text = typed.data();
    if (!text.empty()) (edits.*links).push_back({light, split_names(text)});
    try {
        c.session.edit(std::move(edits));
    } catch (const Error& error) {
        c.requests.done.emplace_back(error.what());
    }
}

const char* kOfFile = "of the scene";
const char* kClearSky = "clear sky with sun";
const char* kColor = "colour";
const char* kFile = "file ...";

/// Returns the name of a choice for the user.
std::string name_of(const EnvironmentChoice& choice) {
    if (const auto* color = std::get_if<vec3>(&choice))
        return *color == vec3(0) ? "none" : *color == vec3(1) ? "white" : kColor;
    if (const auto* preset = std::get_if<SkyPreset>(&choice)) return halflight::name(*preset);
    if (const auto* file = std::get_if<std::filesystem::path>(&choice)) return file->filename().string();
    return std::holds_alternative<ClearSky>(choice) ? kClearSky : kOfFile;
}

void choose_environment(PanelContext& c) {
    std::vector<std::string> all = {kOfFile, "none", "white", kColor, kClearSky};
    for (const SkyPreset preset : sky_presets()) all.emplace_back(halflight::name(preset));
    all.emplace_back(kFile);
    std::string chosen = name_of(c.session.environment());
    if (!choose("Environment", chosen, all,
                "light from all directions. neutral, studio, sky and overcast give a white floor a radiance of 1; the "
                "clear sky with its sun is as bright as outdoors, in nits"))
        return;
    SwitchedOff& before = c.session.switched_off;
    if (const auto* sky = std::get_if<ClearSky>(&c.session.environment())) before.sky = *sky;
    if (const auto* color = std::get_if<vec3>(&c.session.environment()); color && name_of(*color) == kColor)
        before.color = *color;
    if (chosen == kFile)
        c.requests.ask_environment = true;
    else if (chosen == kOfFile)
        c.requests.environment = EnvironmentChoice();
    else if (chosen == kClearSky)
        c.requests.environment = before.sky;
    else if (chosen == kColor)
        c.requests.environment = before.color;
    else
        c.requests.environment = parse_environment("environment", chosen);
}

}  // namespace

void lamp_kinds(PanelContext& c) {
    struct Row {
        LampKind kind;
        const char *label, *help;
    };
    constexpr Row kRows[] = {{LampKind::point, "Point", "a bulb that shines to all sides"},
                             {LampKind::spot, "Spot", "a cone of light"},
                             {LampKind::sun, "Sun", "parallel light from far away"},
                             {LampKind::rectangle, "Rectangle", "a panel or a window that shines to one side"},
                             {LampKind::disc, "Disc", "a round panel that shines to one side"}};
    for (const Row& row : kRows) {
        const bool fits = !is_area(row.kind) || !c.session.in_pages();
        if (ImGui::MenuItem(row.label, nullptr, false, fits)) c.requests.lamp = row.kind;
        tooltip(fits ? row.help : "scenes in pages take no further surfaces");
    }
}

void light_properties_of(PanelContext& c, std::size_t index) {
    SceneEdits& edits = c.session.edits;
    const std::string& name = c.session.references().lights.at(index);
    const Scene values = c.session.edited_values();
    const PunctualLight shown = values.lights.at(index);
    const PunctualLight& own = c.session.lights()[index];
    const LightTypeRow& type = row_of(own.type);
    const AddedLamp* const added = c.session.added_lamp(index);
    const std::optional<AreaLamp> area = c.session.area_lamp(index);
    const LightEdit* const known = find_light_edit(edits, name);
    LightEdit edit = known ? *known : LightEdit();
    const LightEdit before = edit;
    value("Type", added ? fmt::format("{}, added", halflight::name(added->kind)) : type.name);
    const Selection object{ObjectKind::light, index};
    bool on = !HiddenObjects(c.session).contains(object);
    if (checkbox("On", on, "switches the light on or off")) return set_shown(c.session, object, on);
    float intensity = intensity_of(values, own, edit);
    if (slider(fmt::format("Intensity, {}", area ? "nits" : type.unit).c_str(), intensity, 0, 1e6f, "%.5g",
               "intensity of the strongest channel, in the unit of the file", kLogarithmic))
        edit.intensity = intensity;
    slider("Factor", edit.factor, 0, 100, "%.3f", "factor on the intensity", kLogarithmic);
    color_of_light(shown, edit);
    if (type.has_position) {
        dvec3 position = edit.position.value_or(shown.position);
        if (drag("Position", position, 0.002f * static_cast<float>(c.session.diagonal()), "world space, metres"))
            edit.position = glm::clamp(position, kEditPosition.lower, kEditPosition.upper);
    }
    if (type.has_direction || shown.profile != kNone) direction_of_light(shown, edit);
    const auto diagonal = static_cast<float>(c.session.diagonal());
    if (area) {
        size_of_area(*area, diagonal, edit);
    } else {
        size_of_light(shown, diagonal, edit);
        if (shown.type == LightType::spot) cone_of_spot(shown, edit);
        profile_of_light(c, values, shown, added, edit);
    }
    if (!c.session.in_pages()) {
        // A name without a kind would link materials and nodes, too.
        const auto has_plain = [&](const std::vector<LightLink>& links) {
            return std::ranges::find(links, name, &LightLink::light) != links.end();
        };
        const bool is_plain = has_plain(c.session.edits.light_links) || has_plain(c.session.edits.shadow_links);
        const std::string linked = is_plain ? name : "light:" + name;
        link_of_light(c, "Lights only",
                      "objects that the light lights, separated by commas: floor,wall. -floor: all but this", linked,
                      &SceneEdits::light_links);
        link_of_light(c, "Shadows of", "objects that cast the shadows of the light: floor,wall. -floor: all but this",
                      linked, &SceneEdits::shadow_links);
    }
    if (!added && button("Reset light", "restores the light of the scene")) edit = {};
    if (edit != before) light_edit(edits, name) = edit;
    remove_empty(edits);
}

void environment_properties(PanelContext& c) {
    choose_environment(c);
    const EnvironmentChoice& now = c.session.environment();
    if (std::holds_alternative<std::monostate>(now) &&
        c.session.scene().environment.name == halflight::name(SkyPreset::neutral))
        faint_text("The scene's own light reaches little or nothing, so a neutral sky was added. \"none\" removes it.");
    if (const auto* sky = std::get_if<ClearSky>(&now)) {
        ClearSky edited = *sky;
        bool changed = slider("Sun elevation", edited.elevation, kLeastElevation, 90, "%.1f deg", "above the horizon");
        changed |= slider("Sun azimuth", edited.azimuth, -180, 360, "%.1f deg", "clockwise from north (-Z)");
        changed |=
            slider("Turbidity", edited.turbidity, kLeastTurbidity, kMostTurbidity, "%.1f", "haze: 2 is clear, 6 hazy");
        changed |=
            slider("Ground albedo", edited.ground_albedo, 0, 1, "%.2f", "share of light that the ground reflects");
        changed |= slider("Altitude", edited.altitude, 0, kMostAltitude, "%.0f m", "of the eye above the sea");
        if (changed) c.requests.environment = edited;
    }
    if (const auto* color = std::get_if<vec3>(&now); color && *color != vec3(0)) {
        vec3 radiance = *color;
        if (pick_color("Radiance", radiance, "radiance from all directions, linear Rec.709"))
            c.requests.environment = radiance;
    }
    if (c.session.scene().environment.black()) return faint_text("The environment is black.");
    SceneEdits& edits = c.session.edits;
    slider("Intensity", edits.environment_intensity, 0, 100, "%.3f", "factor on the environment and its sun",
           kLogarithmic);
    pick_color("Tint", edits.environment_tint, "colour factor on the environment");
    slider("Rotation", edits.environment_rotation, -180, 180, "%.1f deg", "to the right, seen from inside");
    if (button("Reset environment", "restores intensity, tint and rotation"))
        edits.environment_intensity = 1, edits.environment_tint = vec3(1), edits.environment_rotation = 0;
}

}  // namespace halflight::view
