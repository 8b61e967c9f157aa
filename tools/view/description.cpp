// The short description of a picture, which labels it beside another one of the same scene.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <iterator>

#include "api/halflight/statistics.h"
#include "tools/view/session.h"

namespace halflight::view {
namespace {

constexpr std::size_t kMostValues = 4;  // edits that are named with their values; more of them are counted

/// Returns "light NAME ..." for each edited light, with the edited values.
std::vector<std::string> lights_of(const SceneEdits& edits) {
    std::vector<std::string> lights;
    for (const auto& [name, edit, source] : edits.lights) {
        if (edit == LightEdit()) continue;
        std::string values;
        if (edit.factor != 1) values += fmt::format(" x {:.4g}", edit.factor);
        if (edit.intensity) values += fmt::format(" intensity {:.4g}", *edit.intensity);
        if (edit.temperature) values += fmt::format(" {:.0f} K", *edit.temperature);
        if (edit.color)
            values += fmt::format(" colour {:.2g},{:.2g},{:.2g}", edit.color->r, edit.color->g, edit.color->b);
        if (edit.radius) values += fmt::format(" radius {:.4g} m", *edit.radius);
        if (edit.angle) values += fmt::format(" angle {:.4g} deg", *edit.angle);
        if (!edit.ies.empty()) values += " profile " + edit.ies;
        if (edit.position || edit.direction) values += " moved";
        lights.push_back(fmt::format("light {}{}", name, edit.off ? " off" : values));
    }
    return lights;
}

/// Returns "NAME.PROPERTY=VALUES" for each edited property of materials.
std::vector<std::string> materials_of(const SceneEdits& edits) {
    std::vector<std::string> materials;
    for (const auto& [name, properties, source] : edits.materials)
        for (const auto& [property, values] : properties)
            materials.push_back(fmt::format("{}.{}={:.4g}", name, property, fmt::join(values, ",")));
    return materials;
}

}  // namespace

std::string Session::description() const {
    std::vector<std::string> words = {layer_view.layer};
    if (!timeline_.playing.empty())
        words.push_back(fmt::format("animation {}, frame {}", timeline_.animation, timeline_.frame));
    for (std::size_t i = 0; i < kComponents.size(); ++i)
        if (layer_view.is_sum() && !layer_view.components[i]) words.push_back(fmt::format("no {}", kComponents[i]));
    const auto factor = [&](const char* what, float value) {
        if (value != 1) words.push_back(fmt::format("{} x {:g}", what, value));
    };
    if (const auto* color = std::get_if<vec3>(&environment()))
        words.push_back(fmt::format("environment {:.4g},{:.4g},{:.4g}", color->r, color->g, color->b));
    else if (!std::holds_alternative<std::monostate>(environment()))
        words.push_back("environment " +
                        std::filesystem::path(environment_name(scene_->environment)).filename().string());
    factor("environment", edits.environment_intensity);
    if (edits.environment_rotation != 0) words.push_back(fmt::format("turned by {:g} deg", edits.environment_rotation));
    if (edits.environment_tint != vec3(1)) words.emplace_back("tinted");
    factor("emission", edits.emission);
    if (edits.lamp_radius) words.push_back(fmt::format("lamps of {:.4g} m", *edits.lamp_radius));
    if (edits.sun_angle) words.push_back(fmt::format("suns of {:.4g} deg", *edits.sun_angle));
    if (edits.straight_glass) words.emplace_back("light straight through glass");
    if (edits.ground) words.emplace_back("ground");
    if (edits.clay) words.emplace_back("clay");
    const auto count = [&](std::size_t number, const char* what, const char* how) {
        if (number > 0) words.push_back(fmt::format("{} {}{} {}", number, what, number == 1 ? "" : "s", how));
    };
    for (const AddedLamp& lamp : edits.added_lights)
        words.push_back(fmt::format("{} {} added{}", name(lamp.kind), lamp.name, lamp.edit.off ? ", off" : ""));
    std::vector<std::string> named = lights_of(edits);
    std::ranges::move(materials_of(edits), std::back_inserter(named));
    if (named.size() <= kMostValues) {
        std::ranges::move(named, std::back_inserter(words));
    } else {
        count(lights_of(edits).size(), "light", "edited");
        count(edits.materials.size(), "material", "edited");
    }
    count(edits.transforms.size(), "instance", "moved");
    count(edits.nodes.size(), "node", "moved");
    if (edits.hidden.size() == 1)
        words.push_back(fmt::format("{} hidden", edits.hidden[0].name));
    else
        count(edits.hidden.size(), "name", "hidden");
    count(edits.catchers.size(), "name", "catching shadows");
    count(edits.light_links.size() + edits.shadow_links.size(), "light link", "in use");
    if (modes.preview.any()) words.push_back(fmt::format("preview {}", text(modes.preview)));
    if (modes.show_lamps) words.emplace_back("lamps shown");
    if (modes.denoise) words.emplace_back("denoised");
    if (modes.clamp > 0) words.push_back(fmt::format("clamped to {:g}", modes.clamp));
    words.push_back(fmt::format("{} bounce{}", bounces, bounces == 1 ? "" : "s"));
    return fmt::format("{}", fmt::join(words, ", "));
}

}  // namespace halflight::view
