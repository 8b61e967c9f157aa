#include "engine/io/gltf/driven.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <variant>

#include "engine/io/gltf/value.h"

namespace halflight {
namespace {

using Values = std::vector<double>;

/// Where the model keeps numbers: in a list, as one number, or among extensions, whose keys the pointer tells.
using Place = std::variant<Values*, double*, tinygltf::ExtensionMap*>;

/// What may be driven: "/LIST/N/rest" for any N.
struct Field {
    std::string_view list;
    std::string rest;
    AnimatedProperty property;
    Place (*place)(tinygltf::Model&, std::size_t index);
    Values otherwise;  // as many as it has, and what they are where the file has no such extension; none of weights
};

constexpr std::string_view kNodes = "/nodes/", kMeshes = "/meshes/", kMaterials = "/materials/", kCameras = "/cameras/",
                           kLights = "/extensions/KHR_lights_punctual/lights/", kExtensions = "/extensions/";
constexpr const char* kGlossy = "KHR_materials_pbrSpecularGlossiness";

/// A member of a member of ... of an element of one of the model's lists.
template <auto kList, auto... kMembers>
Place place(tinygltf::Model& model, std::size_t index) {
    return &((model.*kList)[index].*....*kMembers);
}

using Model = tinygltf::Model;

std::vector<Field> plain_fields() {
    using enum AnimatedProperty;
    using Node = tinygltf::Node;
    using Camera = tinygltf::Camera;
    using Perspective = tinygltf::PerspectiveCamera;
    using Orthographic = tinygltf::OrthographicCamera;
    using Light = tinygltf::Light;
    using Spot = tinygltf::SpotLight;
    constexpr auto spot = &Light::spot;
    constexpr auto perspective = &Camera::perspective;
    constexpr auto orthographic = &Camera::orthographic;
    return {
        {kNodes, "/translation", translation, place<&Model::nodes, &Node::translation>, Values(3)},
        {kNodes, "/rotation", rotation, place<&Model::nodes, &Node::rotation>, Values(4)},
        {kNodes, "/scale", scale, place<&Model::nodes, &Node::scale>, Values(3)},
        {kNodes, "/weights", weights, place<&Model::nodes, &Node::weights>, {}},
        {kMeshes, "/weights", mesh_weights, place<&Model::meshes, &tinygltf::Mesh::weights>, {}},
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
    using enum AnimatedProperty;
    using Material = tinygltf::Material;
    using Pbr = tinygltf::PbrMetallicRoughness;
    using Normal = tinygltf::NormalTextureInfo;
    using Texture = tinygltf::TextureInfo;
    constexpr auto pbr = &Material::pbrMetallicRoughness;
    constexpr auto own = place<&Model::materials, &Material::extensions>;
    std::vector<Field> fields{
        {kMaterials, "/alphaCutoff", surface, place<&Model::materials, &Material::alphaCutoff>, {0.5}},
        {kMaterials, "/emissiveFactor", emission, place<&Model::materials, &Material::emissiveFactor>, Values(3)},
        {kMaterials,
         "/normalTexture/scale",
         surface,
         place<&Model::materials, &Material::normalTexture, &Normal::scale>,
         {1}},
        {kMaterials, "/pbrMetallicRoughness/baseColorFactor", surface,
         place<&Model::materials, pbr, &Pbr::baseColorFactor>, Values(4)},
        {kMaterials,
         "/pbrMetallicRoughness/metallicFactor",
         surface,
         place<&Model::materials, pbr, &Pbr::metallicFactor>,
         {1}},
        {kMaterials,
         "/pbrMetallicRoughness/roughnessFactor",
         surface,
         place<&Model::materials, pbr, &Pbr::roughnessFactor>,
         {1}},
    };
    const auto add = [&](const char* extension, const char* rest, AnimatedProperty property, const Values& otherwise) {
        fields.push_back({kMaterials, fmt::format("{}{}/{}", kExtensions, extension, rest), property, own, otherwise});
    };
    add("KHR_materials_clearcoat", "clearcoatFactor", surface, {0});
    add("KHR_materials_clearcoat", "clearcoatRoughnessFactor", surface, {0});
    add("KHR_materials_clearcoat", "clearcoatNormalTexture/scale", surface, {1});
    add("KHR_materials_emissive_strength", "emissiveStrength", emission, {1});
    add("KHR_materials_ior", "ior", surface, {1.5});
    add("KHR_materials_specular", "specularFactor", surface, {1});
    add("KHR_materials_specular", "specularColorFactor", surface, {1, 1, 1});
    add("KHR_materials_transmission", "transmissionFactor", surface, {0});
    add(kGlossy, "diffuseFactor", surface, {1, 1, 1, 1});
    add(kGlossy, "specularFactor", surface, {1, 1, 1});
    add(kGlossy, "glossinessFactor", surface, {1});

    const auto add_texture = [&](const std::string& info, AnimatedProperty property,
                                 decltype(Field::place) extensions) {
        const std::string transform = info + "/extensions/KHR_texture_transform";
        fields.push_back({kMaterials, transform + "/offset", property, extensions, {0, 0}});
        fields.push_back({kMaterials, transform + "/rotation", property, extensions, {0}});
        fields.push_back({kMaterials, transform + "/scale", property, extensions, {1, 1}});
    };
    add_texture("/pbrMetallicRoughness/baseColorTexture", surface,
                place<&Model::materials, pbr, &Pbr::baseColorTexture, &Texture::extensions>);
    add_texture("/pbrMetallicRoughness/metallicRoughnessTexture", surface,
                place<&Model::materials, pbr, &Pbr::metallicRoughnessTexture, &Texture::extensions>);
    add_texture("/emissiveTexture", emission,
                place<&Model::materials, &Material::emissiveTexture, &Texture::extensions>);
    add_texture("/normalTexture", normal_map, place<&Model::materials, &Material::normalTexture, &Normal::extensions>);
    add_texture("/extensions/KHR_materials_clearcoat/clearcoatTexture", surface, own);
    add_texture("/extensions/KHR_materials_clearcoat/clearcoatRoughnessTexture", surface, own);
    add_texture("/extensions/KHR_materials_clearcoat/clearcoatNormalTexture", normal_map, own);
    add_texture("/extensions/KHR_materials_specular/specularTexture", surface, own);
    add_texture("/extensions/KHR_materials_specular/specularColorTexture", surface, own);
    add_texture("/extensions/KHR_materials_transmission/transmissionTexture", surface, own);
    add_texture(fmt::format("{}{}/diffuseTexture", kExtensions, kGlossy), surface, own);
    add_texture(fmt::format("{}{}/specularGlossinessTexture", kExtensions, kGlossy), surface, own);
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

Place place_of(tinygltf::Model& model, const GltfTarget& target) {
    return field_of(target).place(model, static_cast<std::size_t>(target.index));
}

/// Of a field among extensions: the keys below them.
std::string_view keys_of(const Field& field) {
    const std::string_view rest = field.rest;
    return rest.substr(rest.find(kExtensions) + kExtensions.size());
}

/// What stands there in an object, or null.
const tinygltf::Value* find_at(const tinygltf::Value::Object& object, std::string_view keys) {
    const std::size_t end = keys.find('/');
    const tinygltf::Value* found = find_extension(object, std::string(keys.substr(0, end)));
    if (!found || end == std::string_view::npos) return found;
    return found->IsObject() ? find_at(found->Get<tinygltf::Value::Object>(), keys.substr(end + 1)) : nullptr;
}

/// The same; what is not there is made.
tinygltf::Value& make_at(tinygltf::Value::Object& object, std::string_view keys) {
    const std::size_t end = keys.find('/');
    tinygltf::Value& value = object[std::string(keys.substr(0, end))];
    if (end == std::string_view::npos) return value;
    if (!value.IsObject()) value = tinygltf::Value(tinygltf::Value::Object());
    return make_at(value.Get<tinygltf::Value::Object>(), keys.substr(end + 1));
}

std::size_t size_of(const tinygltf::Model& model, std::string_view list) {
    return list == kNodes       ? model.nodes.size()
           : list == kMeshes    ? model.meshes.size()
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

/// Whether what the field is of is there, in an object that has one of several kinds. False where it is, and cannot be
/// driven: glossiness that load_images() has made a texture with.
bool check_kind(const GltfDocument& document, const Field& field, std::size_t index, const std::string& element) {
    const std::string_view rest = field.rest;
    const std::string_view name = rest.substr(rest.rfind('/') + 1);
    if (rest.starts_with("/spot/") && document.model.lights[index].type != "spot")
        document.fail(element, "drives a cone of lights[{}], which is no spot", index);
    for (const char* const type : {"perspective", "orthographic"}) {
        if (rest.starts_with(fmt::format("/{}/", type)) && document.model.cameras[index].type != type)
            document.fail(element, "drives {} of cameras[{}], which is not {}", name, index, type);
    }
    if (!rest.starts_with(fmt::format("{}{}/", kExtensions, kGlossy))) return true;
    const tinygltf::Value* glossy = find_extension(document.model.materials[index].extensions, kGlossy);
    if (!glossy) document.fail(element, "drives {} of materials[{}], which has none", kGlossy, index);
    return name != "glossinessFactor" || !glossy->Has("specularGlossinessTexture");
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
        const std::size_t size = size_of(document.model, list);
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
    return static_cast<int>(field_of(target).otherwise.size());
}

std::vector<double> driven_values(const tinygltf::Model& model, const GltfTarget& target) {
    const Place place = place_of(const_cast<tinygltf::Model&>(model), target);  // is read only
    if (const auto* list = std::get_if<Values*>(&place)) return **list;
    if (const auto* number = std::get_if<double*>(&place)) return {**number};
    const Field& field = field_of(target);
    const tinygltf::Value* found = find_at(*std::get<tinygltf::ExtensionMap*>(place), keys_of(field));
    if (!found) return field.otherwise;
    if (!found->IsArray()) return {found->GetNumberAsDouble()};
    Values values;
    for (const tinygltf::Value& v : found->Get<tinygltf::Value::Array>()) values.push_back(v.GetNumberAsDouble());
    return values;
}

void set_driven_values(tinygltf::Model& model, const GltfTarget& target, const std::vector<double>& values) {
    const Place place = place_of(model, target);
    if (const auto* list = std::get_if<Values*>(&place)) {
        **list = values;
    } else if (const auto* number = std::get_if<double*>(&place)) {
        **number = values.at(0);
    } else {
        const Field& field = field_of(target);
        tinygltf::Value& there = make_at(*std::get<tinygltf::ExtensionMap*>(place), keys_of(field));
        if (field.otherwise.size() == 1) {
            there = tinygltf::Value(values.at(0));
        } else {
            tinygltf::Value::Array numbers;
            for (const double v : values) numbers.emplace_back(v);
            there = tinygltf::Value(std::move(numbers));
        }
    }
}

}  // namespace halflight
