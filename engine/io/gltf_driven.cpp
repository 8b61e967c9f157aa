#include "engine/io/gltf_driven.h"

#include <array>
#include <charconv>
#include <string_view>

#include "engine/io/gltf_value.h"

namespace halflight {
namespace {

constexpr const char* kStrength = "KHR_materials_emissive_strength";

/// "/LIST/N/rest" for any N.
struct Pattern {
    std::string_view list;
    std::string_view rest;
    AnimatedProperty property;
};

constexpr std::string_view kNodes = "/nodes/", kMaterials = "/materials/", kCameras = "/cameras/",
                           kLights = "/extensions/KHR_lights_punctual/lights/";

constexpr std::array kPatterns = {
    Pattern{kNodes, "/translation", AnimatedProperty::translation},
    Pattern{kNodes, "/rotation", AnimatedProperty::rotation},
    Pattern{kNodes, "/scale", AnimatedProperty::scale},
    Pattern{kNodes, "/weights", AnimatedProperty::weights},
    Pattern{kMaterials, "/pbrMetallicRoughness/baseColorFactor", AnimatedProperty::base_color},
    Pattern{kMaterials, "/pbrMetallicRoughness/metallicFactor", AnimatedProperty::metallic},
    Pattern{kMaterials, "/pbrMetallicRoughness/roughnessFactor", AnimatedProperty::roughness},
    Pattern{kMaterials, "/emissiveFactor", AnimatedProperty::emissive_factor},
    Pattern{kMaterials, "/extensions/KHR_materials_emissive_strength/emissiveStrength",
            AnimatedProperty::emissive_strength},
    Pattern{kLights, "/color", AnimatedProperty::light_color},
    Pattern{kLights, "/intensity", AnimatedProperty::light_intensity},
    Pattern{kLights, "/spot/innerConeAngle", AnimatedProperty::inner_cone},
    Pattern{kLights, "/spot/outerConeAngle", AnimatedProperty::outer_cone},
    Pattern{kCameras, "/perspective/yfov", AnimatedProperty::vertical_fov},
};

std::size_t size_of(const tinygltf::Model& model, std::string_view list) {
    return list == kNodes       ? model.nodes.size()
           : list == kMaterials ? model.materials.size()
           : list == kCameras   ? model.cameras.size()
                                : model.lights.size();
}

/// An array index of a JSON pointer (RFC 6901, section 4): digits without a zero in front.
std::optional<std::size_t> array_index(std::string_view text) {
    std::size_t index = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), index);
    const bool whole = error == std::errc() && end == text.data() + text.size();
    return whole && (text == "0" || text.front() != '0') ? std::optional(index) : std::nullopt;
}

void check_target(const GltfDocument& document, const GltfTarget& target, const std::string& element) {
    const auto index = static_cast<std::size_t>(target.index);
    const bool cone =
        target.property == AnimatedProperty::inner_cone || target.property == AnimatedProperty::outer_cone;
    if (cone && document.model.lights[index].type != "spot")
        document.fail(element, "drives a cone of lights[{}], which is no spot", index);
    if (target.property == AnimatedProperty::vertical_fov && document.model.cameras[index].type != "perspective")
        document.fail(element, "drives yfov of cameras[{}], which is not perspective", index);
}

/// Where the model keeps it.
struct Place {
    std::vector<double>* list = nullptr;
    double* number = nullptr;
    tinygltf::ExtensionMap* strength = nullptr;
};

Place place_of(tinygltf::Model& model, const GltfTarget& target) {
    using enum AnimatedProperty;
    const auto index = static_cast<std::size_t>(target.index);
    switch (target.property) {
        case translation:
            return {.list = &model.nodes[index].translation};
        case rotation:
            return {.list = &model.nodes[index].rotation};
        case scale:
            return {.list = &model.nodes[index].scale};
        case weights:
            return {.list = &model.nodes[index].weights};
        case base_color:
            return {.list = &model.materials[index].pbrMetallicRoughness.baseColorFactor};
        case metallic:
            return {.number = &model.materials[index].pbrMetallicRoughness.metallicFactor};
        case roughness:
            return {.number = &model.materials[index].pbrMetallicRoughness.roughnessFactor};
        case emissive_factor:
            return {.list = &model.materials[index].emissiveFactor};
        case emissive_strength:
            return {.strength = &model.materials[index].extensions};
        case light_color:
            return {.list = &model.lights[index].color};
        case light_intensity:
            return {.number = &model.lights[index].intensity};
        case inner_cone:
            return {.number = &model.lights[index].spot.innerConeAngle};
        case outer_cone:
            return {.number = &model.lights[index].spot.outerConeAngle};
        case vertical_fov:
            return {.number = &model.cameras[index].perspective.yfov};
    }
    return {};
}

}  // namespace

std::optional<GltfTarget> follow_pointer(const GltfDocument& document, const std::string& pointer,
                                         const std::string& element) {
    if (!pointer.starts_with('/')) document.fail(element, "'{}' is no JSON pointer", pointer);
    for (const Pattern& pattern : kPatterns) {
        std::string_view rest = pointer;
        if (!rest.starts_with(pattern.list)) continue;
        rest.remove_prefix(pattern.list.size());
        const std::string_view number = rest.substr(0, rest.find('/'));
        const auto index = array_index(number);
        const std::size_t size = size_of(document.model, pattern.list);
        if (!index || *index >= size)
            document.fail(element, "pointer '{}': '{}' is not an index into a list of {}", pointer, number, size);
        if (rest.substr(number.size()) != pattern.rest) continue;
        const GltfTarget target{pattern.property, static_cast<int>(*index)};
        check_target(document, target, element);
        return target;
    }
    return std::nullopt;
}

int components_of(AnimatedProperty property) {
    using enum AnimatedProperty;
    switch (property) {
        case weights:
            return 0;
        case rotation:
        case base_color:
            return 4;
        case translation:
        case scale:
        case emissive_factor:
        case light_color:
            return 3;
        default:
            return 1;
    }
}

std::vector<double> driven_values(const tinygltf::Model& model, const GltfTarget& target) {
    const Place place = place_of(const_cast<tinygltf::Model&>(model), target);  // is read only
    if (place.list) return *place.list;
    if (place.number) return {*place.number};
    const tinygltf::Value* strength = find_extension(*place.strength, kStrength);
    return {strength ? number(*strength, "emissiveStrength", 1) : 1};
}

void set_driven_values(tinygltf::Model& model, const GltfTarget& target, const std::vector<double>& values) {
    const Place place = place_of(model, target);
    if (place.list)
        *place.list = values;
    else if (place.number)
        *place.number = values.at(0);
    else
        (*place.strength)[kStrength] =
            tinygltf::Value(tinygltf::Value::Object{{"emissiveStrength", tinygltf::Value(values.at(0))}});
}

}  // namespace halflight
