#include "engine/io/gltf/material_keys.h"

#include "engine/scene/material_properties.h"

namespace halflight {
namespace {

using Kind = GltfMaterialKey::Kind;

constexpr std::string_view kExtensions = "/extensions/";

GltfMaterialKey key_of(const MaterialProperty& property) {
    if (std::holds_alternative<bool Material::*>(property.field)) {
        const std::string_view path = property.path;
        const bool extension = path.starts_with(kExtensions) && path.find('/', kExtensions.size()) == path.npos;
        return {property.path, extension ? Kind::extension : Kind::flag, {}, property.animated};
    }
    const int count = component_count(property.field);
    const vec4 value = value_of(Material{}, property.field);
    GltfMaterialKey key{property.path, count == 1 ? Kind::number : Kind::numbers, {}, property.animated};
    for (int i = 0; i < count; ++i) key.default_value.push_back(value[i]);
    return key;
}

GltfMaterialKey key_of(const MaterialTexture& texture) {
    const AnimatedProperty animated = needs_tangents(texture.use)                   ? AnimatedProperty::normal_map
                                      : texture.implies == &MaterialNeeds::emission ? AnimatedProperty::emission
                                                                                    : AnimatedProperty::surface;
    return {texture.path, Kind::texture, {}, animated};
}

std::vector<GltfMaterialKey> converted_keys() {
    const std::string glossy = kSpecularGlossiness;
    const AnimatedProperty surface = AnimatedProperty::surface;
    return {
        {"/extensions/KHR_materials_emissive_strength/emissiveStrength", Kind::number, {1}, AnimatedProperty::emission},
        {glossy + "/diffuseFactor", Kind::numbers, {1, 1, 1, 1}, surface},
        {glossy + "/diffuseTexture", Kind::texture, {}, surface},
        {glossy + "/specularFactor", Kind::numbers, {1, 1, 1}, surface},
        {glossy + "/glossinessFactor", Kind::number, {1}, surface},
        {glossy + "/specularGlossinessTexture", Kind::texture, {}, surface},
    };
}

}  // namespace

const std::vector<GltfMaterialKey>& gltf_material_keys() {
    static const std::vector<GltfMaterialKey> keys = [] {
        std::vector<GltfMaterialKey> all = converted_keys();
        for (const MaterialProperty& property : material_properties())
            if (*property.path) all.push_back(key_of(property));
        for (const MaterialTexture& texture : material_textures()) all.push_back(key_of(texture));
        return all;
    }();
    return keys;
}

}  // namespace halflight
