#include "engine/io/gltf/material.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/io/gltf/material_keys.h"

namespace halflight {
namespace {

using Json = nlohmann::json;

/// F0 of the default index of refraction, 1.5.
constexpr float kDefaultF0 = 0.04f;

/// Follows a JSON pointer of names; null: there is no such value. Json::json_pointer takes much longer.
const Json* find(const Json& value, std::string_view path) {
    const Json* found = &value;
    while (!path.empty()) {
        const std::size_t end = std::min(path.find('/', 1), path.size());
        const auto next = found->find(path.substr(1, end - 1));
        if (next == found->end()) return nullptr;
        found = &*next;
        path.remove_prefix(end);
    }
    return found;
}

double number(const Json& value, const std::string& path, double otherwise) {
    const Json* found = find(value, path);
    return found ? found->get<double>() : otherwise;
}

dvec2 pair(const Json& value, const char* key, const dvec2& otherwise) {
    const auto found = value.find(key);
    return found == value.end() ? otherwise : dvec2((*found)[0].get<double>(), (*found)[1].get<double>());
}

/// Returns T R S of KHR_texture_transform. The rotation is counter-clockwise as seen in an image whose v points down.
/// This follows the extension's words and sample model; the GLSL in its text has the other sign (glTF issue 1563).
glm::mat3x2 uv_transform(const Json& transform) {
    const dvec2 offset = pair(transform, "offset", dvec2(0)), scale = pair(transform, "scale", dvec2(1));
    const double rotation = transform.value("rotation", 0.0);
    const double c = std::cos(rotation), s = std::sin(rotation);
    return {vec2(dvec2(c, -s) * scale.x), vec2(dvec2(s, c) * scale.y), vec2(offset)};
}

class Converter {
  public:
    Converter(GltfDocument& document, std::size_t index)
        : document_(document), from_(document.materials[index]), element_(fmt::format("materials[{}]", index)) {}

    GltfMaterial convert() {
        m_.name = from_.value("name", "");
        m_.unlit = find(from_, "/extensions/KHR_materials_unlit") != nullptr;
        glossy_ = find(from_, kSpecularGlossiness);
        read_alpha_mode();
        if (glossy_) read_specular_glossiness();
        for (const MaterialProperty& property : material_properties())
            if (*property.path && is_read(property.path, property.need)) read(property);
        for (const MaterialTexture& texture : material_textures()) {
            if (!is_read(texture.path, texture.implies)) continue;
            if (const TextureRef ref = read_texture(texture.path)) m_.*texture.field = ref;
        }
        m_.specular_color *= f0_scale_;
        result_.anisotropic = find(from_, "/extensions/KHR_materials_anisotropy") != nullptr;
        m_.straight_shadows = document_.options.straight_glass;
        choose_uv_sets();
        return std::move(result_);
    }

  private:
    /// Returns whether the property applies. Specular-glossiness replaces metallic-roughness, and unlit materials
    /// ignore their emission factor.
    bool is_read(std::string_view path, bool MaterialNeeds::*need) const {
        return !(glossy_ && path.starts_with("/pbrMetallicRoughness/")) &&
               !(m_.unlit && need == &MaterialNeeds::emission);
    }

    void read(const MaterialProperty& property) {
        const Json* found = find(from_, property.path);
        if (!found) return;
        if (std::holds_alternative<bool Material::*>(property.field))
            return set_value(m_, property.field, vec4(!found->is_boolean() || found->get<bool>()));
        if (property.field == MaterialField(&Material::ior) && *found == 0.0) {  // stands for an infinite one
            m_.ior = kInfiniteIor;
            return;
        }
        const double scale = property.field == MaterialField(&Material::emission)
                                 ? number(from_, "/extensions/KHR_materials_emissive_strength/emissiveStrength", 1)
                                 : 1;
        set_value(m_, property.field,
                  read_clamped(property.path, component_count(property.field), property.range, scale));
    }

    /// Returns `count` numbers times `scale`, clamped to the range with a warning; 1 if the file does not have them.
    vec4 read_clamped(const std::string& path, int count, const PropertyRange& range, double scale = 1) {
        constexpr double kMaxFloat = std::numeric_limits<float>::max();
        const double lowest = std::max<double>(range.lowest, -kMaxFloat);
        const double highest = std::min<double>(range.highest, kMaxFloat);
        const Json* found = find(from_, path);
        vec4 result(0);
        for (int i = 0; i < count; ++i) {
            const Json* number = !found || count == 1 ? found : &(*found)[static_cast<std::size_t>(i)];
            const double value = number ? scale * number->get<double>() : 1;
            if (!(value >= lowest && value <= highest))
                document_.value_fault(
                    fmt::format("{} is outside [{}, {}], clamped", label(path), range.lowest, range.highest), element_);
            result[i] = static_cast<float>(std::clamp(value, lowest, highest));
        }
        return result;
    }

    /// Returns "clearcoatNormalTexture.scale" for "/extensions/KHR_materials_clearcoat/clearcoatNormalTexture/scale".
    static std::string label(std::string path) {
        const bool extension = path.starts_with("/extensions/"), pbr = path.starts_with("/pbrMetallicRoughness/");
        path.erase(0, extension || pbr ? path.find('/', extension ? 12 : 1) + 1 : 1);
        std::ranges::replace(path, '/', '.');
        return path;
    }

    Wrap wrap(int mode) {
        if (mode == TINYGLTF_TEXTURE_WRAP_CLAMP_TO_EDGE) return Wrap::clamp_to_edge;
        if (mode == TINYGLTF_TEXTURE_WRAP_MIRRORED_REPEAT) return Wrap::mirrored_repeat;
        if (mode != TINYGLTF_TEXTURE_WRAP_REPEAT)
            document_.warnings.fault(fmt::format("wrap mode {} is unknown, taken as repeat", mode), element_);
        return Wrap::repeat;
    }

    /// Reads a textureInfo. uv_set is the file's TEXCOORD index until choose_uv_sets().
    TextureRef read_texture(const std::string& path) {
        TextureRef ref;
        const Json* info = find(from_, path);
        const int index = info ? info->value("index", kNone) : kNone;  // animations may leave no index
        if (index == kNone) return ref;
        const tinygltf::Texture& from = document_.model.textures[static_cast<std::size_t>(index)];
        if (from.source == kNone) {
            document_.warnings.add("has no image, it is not used", fmt::format("textures[{}]", index));
            return ref;
        }
        ref.image = from.source;
        ref.uv_set = info->value("texCoord", 0);
        if (from.sampler != kNone) {
            const tinygltf::Sampler& sampler = document_.model.samplers[static_cast<std::size_t>(from.sampler)];
            ref.wrap_u = wrap(sampler.wrapS);
            ref.wrap_v = wrap(sampler.wrapT);
            ref.nearest = sampler.magFilter == TINYGLTF_TEXTURE_FILTER_NEAREST;
        }
        if (const Json* transform = find(*info, "/extensions/KHR_texture_transform")) {
            ref.uv_transform = uv_transform(*transform);
            ref.uv_set = transform->value("texCoord", ref.uv_set);
        }
        return ref;
    }

    void read_alpha_mode() {
        const std::string mode = from_.value("alphaMode", "OPAQUE");
        if (mode == "MASK")
            m_.alpha_mode = AlphaMode::mask;
        else if (mode == "BLEND")
            m_.alpha_mode = AlphaMode::blend;
        else if (mode != "OPAQUE")
            document_.warnings.fault(fmt::format("alphaMode '{}' is unknown, taken as OPAQUE", mode), element_);
    }

    /// Converts to a dielectric with the same reflectances, whose F0 is `specular`. load_images() converts glossiness
    /// textures to roughness.
    void read_specular_glossiness() {
        const std::string at = kSpecularGlossiness;
        const PropertyRange fraction{0, 1}, not_negative{.lowest = 0};
        m_.base_color = read_clamped(at + "/diffuseFactor", 4, fraction);
        m_.base_color_texture = read_texture(at + "/diffuseTexture");
        m_.metallic = 0;
        const float glossiness = read_clamped(at + "/glossinessFactor", 1, fraction).x;
        f0_scale_ = vec3(read_clamped(at + "/specularFactor", 3, not_negative)) / kDefaultF0;
        m_.specular_color_texture = read_texture(at + "/specularGlossinessTexture");
        m_.roughness = 1 - glossiness;
        if (m_.specular_color_texture) result_.glossiness = glossiness;
    }

    void choose_uv_sets() {
        std::vector<int> used;
        for_each_texture(m_, [&](const TextureRef& t) {
            if (t && std::ranges::find(used, t.uv_set) == used.end()) used.push_back(t.uv_set);
        });
        if (std::ranges::all_of(used, [](int set) { return set < 2; })) return;
        if (used.size() > 2) {
            document_.warnings.add("uses more than two sets of texture coordinates; the first two serve all", element_);
            used.resize(2);
        }
        std::ranges::copy(used, result_.uv_sets.begin());
        for_each_texture(m_, [&](TextureRef& t) { t.uv_set = used.size() == 2 && t.uv_set == used[1] ? 1 : 0; });
    }

    GltfDocument& document_;
    const Json& from_;
    const std::string element_;
    const Json* glossy_ = nullptr;  // KHR_materials_pbrSpecularGlossiness; null: none
    vec3 f0_scale_{1};              // factor for the specular colour of specular-glossiness
    GltfMaterial result_;
    Material& m_ = result_.material;
};

}  // namespace

std::vector<GltfMaterial> convert_materials(GltfDocument& document) {
    std::vector<GltfMaterial> materials;
    for (std::size_t i = 0; i < document.materials.size(); ++i) materials.push_back(Converter(document, i).convert());
    return materials;
}

}  // namespace halflight
