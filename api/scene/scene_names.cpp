#include "api/scene/scene_names.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <nlohmann/json.hpp>
#include <string_view>

#include "api/halflight/edit_text.h"
#include "api/halflight/object_names.h"
#include "api/scene/added_surfaces.h"
#include "api/scene/node_edits.h"
#include "engine/scene/light_types.h"
#include "engine/scene/material_properties.h"

namespace halflight {
namespace {

using Json = nlohmann::ordered_json;

Json entry(std::string_view name, std::size_t number, Json options) {
    return {{"name", name}, {"number", number}, {"options", std::move(options)}};
}

Json option(const char* name, const std::string& value) {
    return Json::array({name, value});
}

/// Returns the options that choose a camera alone. Names come before numbers, so a camera has none if its own name
/// is missing or not unique and its number is the name of another one.
Json options_of_camera(const Scene& scene, std::size_t index) {
    const auto count = [&](const std::string& name) { return std::ranges::count(scene.cameras, name, &Camera::name); };
    const std::string& name = scene.cameras[index].name;
    const std::string number = std::to_string(index);
    const bool plain = std::ranges::none_of(name, [](unsigned char c) { return std::iscntrl(c) != 0; });
    if (!name.empty() && plain && count(name) == 1) return Json::array({option("--camera", name)});
    return count(number) == 0 ? Json::array({option("--camera", number)}) : Json::array();
}

LightEdit values_of(const Scene& scene, const PunctualLight& light) {
    const LightTypeRow& type = row_of(light.type);
    const LightColor own = color_of(light);
    LightEdit edit;
    edit.intensity = own.intensity;
    edit.color = own.color;
    if (type.has_position) edit.position = light.position;
    if (type.has_direction || light.profile != kNone) edit.direction = unit_direction(dvec3(light.direction));
    if (type.has_position)
        edit.radius = light.radius;
    else
        edit.angle = glm::degrees(light.angle);
    if (light.type == LightType::spot)
        edit.inner = glm::degrees(light.inner_cone), edit.outer = std::min(glm::degrees(light.outer_cone), 90.0f);
    if (light.profile != kNone) edit.ies = scene.light_profiles[static_cast<std::size_t>(light.profile)].path;
    return edit;
}

LightEdit values_of(const AreaLamp& lamp) {
    const LightColor own = color_of(lamp.light);
    LightEdit edit;
    edit.intensity = own.intensity;
    edit.color = own.color;
    edit.position = lamp.light.position;
    edit.direction = unit_direction(dvec3(lamp.light.direction));
    edit.size = lamp.size;
    return edit;
}

/// Returns the options of the properties that a material sets, and of the usual ones.
Json options_of(const Material& material, const std::string& reference) {
    constexpr std::string_view kUsual[] = {"base_color", "metallic", "roughness"};
    const Material plain;
    Json options = Json::array();
    for (const MaterialProperty& p : material_properties()) {
        const vec4 value = value_of(material, p.field);
        if (value == value_of(plain, p.field) && std::ranges::find(kUsual, p.name) == std::end(kUsual)) continue;
        const std::span<const float> components(&value[0], static_cast<std::size_t>(component_count(p.field)));
        options.push_back(option("--material", fmt::format("{}.{}={}", reference, p.name, property_text(components))));
    }
    return options;
}

/// Quotes an argument for a shell if it needs that.
std::string shell_quoted(std::string_view argument) {
    constexpr std::string_view kPlain = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_.,:=/+@%";
    if (!argument.empty() && argument.find_first_not_of(kPlain) == std::string_view::npos) return std::string(argument);
    std::string text = "'";
    for (const char c : argument) text += c == '\'' ? std::string("'\\''") : std::string(1, c);
    return text + "'";
}

}  // namespace

Json name_facts(const Scene& scene, const SceneTree& tree, const std::vector<std::string>& variants) {
    Json names{{"cameras", Json::array()},   {"variants", Json::array()}, {"lights", Json::array()},
               {"materials", Json::array()}, {"meshes", Json::array()},   {"nodes", Json::array()}};
    for (std::size_t i = 0; i < scene.cameras.size(); ++i)
        names["cameras"].push_back(entry(scene.cameras[i].name, i, options_of_camera(scene, i)));
    for (std::size_t i = 0; i < variants.size(); ++i)
        names["variants"].push_back(entry(variants[i], i, Json::array({option("--variant", variants[i])})));
    const auto lights = references_to(lights_of(scene));
    const auto add_light = [&](const std::string& name, const LightEdit& values) {
        const std::size_t i = names["lights"].size();
        const std::string value = fmt::format("{}={}", lights[i], text(values));
        names["lights"].push_back(entry(name, i, Json::array({option("--light", value)})));
    };
    for (const PunctualLight& light : scene.lights) add_light(light.name, values_of(scene, light));
    for (const AreaLamp& lamp : area_lamps_of(scene)) add_light(lamp.light.name, values_of(lamp));
    const auto materials = references_to(materials_of(scene));
    for (std::size_t i = 0; i < materials.size(); ++i)
        names["materials"].push_back(entry(scene.materials[i].name, i, options_of(scene.materials[i], materials[i])));
    const auto meshes = references_to(meshes_of(scene));
    for (std::size_t i = 0; i < meshes.size(); ++i)
        names["meshes"].push_back(entry(scene.meshes[i].name, i, Json::array({option("--hide", "mesh:" + meshes[i])})));
    const auto nodes = references_to(nodes_of(tree));
    const std::vector<bool> movable = movable_nodes(scene, tree);
    for (std::size_t i = 0; i < nodes.size(); ++i) {
        if (!tree.nodes[i].in_scene) continue;
        const dvec3 origin(tree.nodes[i].to_world[3]);
        Json options = Json::array();
        if (movable[i]) options.push_back(option("--node", fmt::format("{}=translate:0,0,0", nodes[i])));
        Json node = entry(tree.nodes[i].name, i, std::move(options));
        node["origin"] = {origin.x, origin.y, origin.z};
        if (tree.nodes[i].parent != kNone) node["parent"] = tree.nodes[i].parent;
        names["nodes"].push_back(std::move(node));
    }
    return names;
}

std::string option_lines(const Json& names) {
    std::string lines;
    for (const auto& [kind, list] : names.items())
        for (const Json& one : list)
            for (const Json& o : one.at("options"))
                lines += fmt::format("{} {}\n", o.at(0).get<std::string>(), shell_quoted(o.at(1).get<std::string>()));
    return lines;
}

}  // namespace halflight
