#include "engine/io/gltf/driven.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <variant>

#include "engine/core/math.h"
#include "engine/io/gltf/material_keys.h"

namespace halflight {
namespace {

using Json = nlohmann::json;
using Values = std::vector<double>;

/// Storage of a field's numbers in the model: a list, or one number.
using Place = std::variant<Values*, double*>;

/// A field that animations can drive: "/LIST/N/rest" for any N.
struct Field {
    std::string_view list;
    std::string rest;
    AnimatedProperty property;
    Place (*place)(GltfDocument&, std::size_t index);  // null: `rest` is a pointer within GltfDocument::materials[N]
    Values default_values;  // one per component; empty for weights, whose number depends on the mesh
};

constexpr std::string_view kNodes = "/nodes/", kMeshes = "/meshes/", kMaterials = "/materials/", kCameras = "/cameras/",
                           kLights = "/extensions/KHR_lights_punctual/lights/";
constexpr const char* kVisible = "/extensions/KHR_node_visibility/visible";

/// Returns the place of a nested member in an element of one of the model's lists.
template <auto kList, auto... kMembers>
Place place(GltfDocument& document, std::size_t index) {
    return &((document.model.*kList)[index].*....*kMembers);
}

using tinygltf::Model;

std::vector<Field> plain_fields() {
    using enum AnimatedProperty;
    using tinygltf::Camera, tinygltf::Light, tinygltf::Mesh, tinygltf::Node;
    using Perspective = tinygltf::PerspectiveCamera;
    using Orthographic = tinygltf::OrthographicCamera;
    using Spot = tinygltf::SpotLight;
    constexpr auto spot = &Light::spot;
    constexpr auto perspective = &Camera::perspective;
    constexpr auto orthographic = &Camera::orthographic;
    return {
        {kNodes, "/translation", translation, place<&Model::nodes, &Node::translation>, Values(3)},
        {kNodes, "/rotation", rotation, place<&Model::nodes, &Node::rotation>, Values(4)},
        {kNodes, "/scale", scale, place<&Model::nodes, &Node::scale>, Values(3)},
        {kNodes, kVisible, visibility, [](GltfDocument& d, std::size_t node) { return Place(&d.visible[node]); }, {1}},
        {kNodes, "/weights", weights, place<&Model::nodes, &Node::weights>, {}},
        {kMeshes, "/weights", mesh_weights, place<&Model::meshes, &Mesh::weights>, {}},
        {kLights, "/color", light, place<&Model::lights, &Light::color>, Values(3)},
        {kLights, "/intensity", light, place<&Model::lights, &Light::intensity>, {1}},
        {kLights, "/spot/innerConeAngle", light, place<&Model::lights, spot, &Spot::innerConeAngle>, {0}},
        {kLights, "/spot/outerConeAngle", light, place<&Model::lights, spot, &Spot::outerConeAngle>, {kPi / 4}},
        {kCameras,
         "/perspective/aspectRatio",
         camera,
         place<&Model::cameras, perspective, &Perspective::aspectRatio>,
         {0}},
        {kCameras, "/perspective/yfov", camera, place<&Model::cameras, perspective, &Perspective::yfov>, {0}},
        {kCameras, "/perspective/zfar", camera, place<&Model::cameras, perspective, &Perspective::zfar>, {0}},
        {kCameras, "/perspective/znear", camera, place<&Model::cameras, perspective, &Perspective::znear>, {0}},
        {kCameras, "/orthographic/xmag", camera, place<&Model::cameras, orthographic, &Orthographic::xmag>, {0}},
        {kCameras, "/orthographic/ymag", camera, place<&Model::cameras, orthographic, &Orthographic::ymag>, {0}},
        {kCameras, "/orthographic/zfar", camera, place<&Model::cameras, orthographic, &Orthographic::zfar>, {0}},
        {kCameras, "/orthographic/znear", camera, place<&Model::cameras, orthographic, &Orthographic::znear>, {0}},
    };
}

std::vector<Field> material_fields() {
    using Kind = GltfMaterialKey::Kind;
    std::vector<Field> fields;
    for (const GltfMaterialKey& key : gltf_material_keys()) {
        if (key.kind == Kind::number || key.kind == Kind::numbers)
            fields.push_back({kMaterials, key.path, key.animated, nullptr, key.default_value});
        if (key.kind != Kind::texture) continue;
        const std::string transform = key.path + "/extensions/KHR_texture_transform";
        fields.push_back({kMaterials, transform + "/offset", key.animated, nullptr, {0, 0}});
        fields.push_back({kMaterials, transform + "/rotation", key.animated, nullptr, {0}});
        fields.push_back({kMaterials, transform + "/scale", key.animated, nullptr, {1, 1}});
    }
    return fields;
}

const std::vector<Field>& fields() {
    static const std::vector<Field> all = [] {
        std::vector<Field> fields = plain_fields();
        std::ranges::move(material_fields(), std::back_inserter(fields));
        return fields;
    }();
    return all;
}

const Field& field_of(const GltfTarget& target) {
    return fields().at(static_cast<std::size_t>(target.field));
}

std::size_t size_of(const GltfDocument& document, std::string_view list) {
    const tinygltf::Model& model = document.model;
    return list == kNodes       ? model.nodes.size()
           : list == kMeshes    ? model.meshes.size()
           : list == kMaterials ? document.materials.size()
           : list == kCameras   ? model.cameras.size()
                                : model.lights.size();
}

/// Returns the array index of a JSON pointer (RFC 6901, section 4): digits without a leading zero.
std::optional<std::size_t> array_index(std::string_view text) {
    std::size_t index = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), index);
    const bool whole = error == std::errc() && end == text.data() + text.size();
    return whole && (text == "0" || text.front() != '0') ? std::optional(index) : std::nullopt;
}

/// Checks that the object is of the kind that has the field. Returns false if the field cannot be driven:
/// glossiness that load_images() has turned into a texture of roughness, and an infinite index of refraction, written
/// 0.
bool check_kind(const GltfDocument& document, const Field& field, std::size_t index, const std::string& element) {
    const std::string_view rest = field.rest;
    const std::string_view name = rest.substr(rest.rfind('/') + 1);
    if (rest.starts_with("/spot/") && document.model.lights[index].type != "spot")
        document.fail(element, "drives a cone of lights[{}], which is no spot", index);
    for (const char* const type : {"perspective", "orthographic"}) {
        if (rest.starts_with(fmt::format("/{}/", type)) && document.model.cameras[index].type != type)
            document.fail(element, "drives {} of cameras[{}], which is not {}", name, index, type);
    }
    const std::string glossy = kSpecularGlossiness, ior = "/extensions/KHR_materials_ior/ior";
    if (rest == ior) return document.materials[index].value(Json::json_pointer(ior), 1.5) != 0;
    if (!rest.starts_with(glossy + "/")) return true;
    const Json& material = document.materials[index];
    if (!material.contains(Json::json_pointer(glossy)))
        document.fail(element, "drives {} of materials[{}], which has none", glossy.substr(glossy.rfind('/') + 1),
                      index);
    return name != "glossinessFactor" || !material.contains(Json::json_pointer(glossy + "/specularGlossinessTexture"));
}

}  // namespace

std::optional<GltfTarget> follow_pointer(const GltfDocument& document, const std::string& pointer,
                                         const std::string& element) {
    if (!pointer.starts_with('/')) document.fail(element, "'{}' is no JSON pointer", pointer);
    for (const std::string_view list : {kNodes, kMeshes, kMaterials, kCameras, kLights}) {
        std::string_view rest = pointer;
        if (!rest.starts_with(list)) continue;
        rest.remove_prefix(list.size());
        const std::string_view number = rest.substr(0, rest.find('/'));
        const auto index = array_index(number);
        const std::size_t size = size_of(document, list);
        if (!index || *index >= size)
            document.fail(element, "pointer '{}': '{}' is not an index into a list of {}", pointer, number, size);
        rest.remove_prefix(number.size());
        const auto found =
            std::ranges::find_if(fields(), [&](const Field& f) { return f.list == list && f.rest == rest; });
        if (found == fields().end() || !check_kind(document, *found, *index, element)) return std::nullopt;
        return GltfTarget{static_cast<int>(found - fields().begin()), static_cast<int>(*index)};
    }
    return std::nullopt;
}

std::set<int> switched_nodes(const Json& animations, std::size_t nodes) {
    std::set<int> switched;
    const auto look = [&](const auto& self, const Json& value) -> void {
        if (value.is_string()) {
            std::string_view pointer = value.get_ref<const std::string&>();
            if (!pointer.starts_with(kNodes) || !pointer.ends_with(kVisible)) return;
            pointer.remove_prefix(kNodes.size());
            pointer.remove_suffix(std::min(std::string_view(kVisible).size(), pointer.size()));
            if (const auto index = array_index(pointer); index && *index < nodes)
                switched.insert(static_cast<int>(*index));
        }
        for (const char* const key : {"channels", "target", "extensions", "KHR_animation_pointer", "pointer"})
            if (value.is_object() && value.contains(key)) self(self, value[key]);
        if (value.is_array())
            for (const Json& element : value) self(self, element);
    };
    look(look, animations);
    return switched;
}

std::optional<GltfTarget> node_target(std::string_view path, int node) {
    const auto found = std::ranges::find_if(
        fields(), [&](const Field& f) { return f.list == kNodes && std::string_view(f.rest).substr(1) == path; });
    if (found == fields().end()) return std::nullopt;
    return GltfTarget{static_cast<int>(found - fields().begin()), node};
}

AnimatedProperty property_of(const GltfTarget& target) {
    return field_of(target).property;
}

int components_of(const GltfTarget& target) {
    return static_cast<int>(field_of(target).default_values.size());
}

std::vector<double> driven_values(const GltfDocument& document, const GltfTarget& target) {
    const Field& field = field_of(target);
    const auto index = static_cast<std::size_t>(target.index);
    if (!field.place) {
        const Json& material = document.materials[index];
        const Json::json_pointer pointer(field.rest);
        if (!material.contains(pointer)) return field.default_values;
        const Json& found = material.at(pointer);
        return found.is_array() ? found.get<Values>() : Values{found.get<double>()};
    }
    const Place place = field.place(const_cast<GltfDocument&>(document), index);  // the document is only read
    if (const auto* number = std::get_if<double*>(&place)) return {**number};
    return *std::get<Values*>(place);
}

void set_driven_values(GltfDocument& document, const GltfTarget& target, const std::vector<double>& values) {
    const Field& field = field_of(target);
    const auto index = static_cast<std::size_t>(target.index);
    if (!field.place) {
        Json& place = document.materials[index][Json::json_pointer(field.rest)];  // a missing member is created
        place = field.default_values.size() == 1 ? Json(values.at(0)) : Json(values);
        return;
    }
    const Place place = field.place(document, index);
    if (const auto* number = std::get_if<double*>(&place))
        **number = values.at(0);
    else
        *std::get<Values*>(place) = values;
}

}  // namespace halflight
