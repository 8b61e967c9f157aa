#include "engine/io/gltf/material.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/io/gltf/value.h"

namespace halflight {
namespace {

constexpr double kMaxFloat = std::numeric_limits<float>::max();

/// F0 of the default index of refraction, 1.5.
constexpr double kDefaultF0 = 0.04;

/// A textureInfo, wherever it was written.
struct TextureUse {
    int index = kNone;
    int tex_coord = 0;
    double scale = 1;
    const tinygltf::Value* transform = nullptr;  // KHR_texture_transform
};

template <class Info>
TextureUse use_of(const Info& info) {
    return {info.index, info.texCoord, 1, find_extension(info.extensions, "KHR_texture_transform")};
}

TextureUse use_of(const tinygltf::Value& object, const std::string& key) {
    if (!object.Has(key)) return {};
    const tinygltf::Value& info = object.Get(key);
    TextureUse use{integer(info, "index", kNone), integer(info, "texCoord", 0), number(info, "scale", 1), nullptr};
    if (info.Has("extensions") && info.Get("extensions").Has("KHR_texture_transform"))
        use.transform = &info.Get("extensions").Get("KHR_texture_transform");
    return use;
}

/// T R S of KHR_texture_transform. Rotation is counter-clockwise as seen in an image whose v points down, as in the
/// extension's words and sample model; the GLSL in its text has the other sign (glTF issue 1563).
glm::mat3x2 uv_transform(const tinygltf::Value& transform) {
    const dvec2 offset = vector(transform, "offset", dvec2(0)), scale = vector(transform, "scale", dvec2(1));
    const double rotation = number(transform, "rotation", 0);
    const double c = std::cos(rotation), s = std::sin(rotation);
    return {vec2(dvec2(c, -s) * scale.x), vec2(dvec2(s, c) * scale.y), vec2(offset)};
}

class Converter {
  public:
    Converter(GltfDocument& document, std::size_t index)
        : document_(document), from_(document.model.materials[index]), element_(fmt::format("materials[{}]", index)) {}

    GltfMaterial convert() {
        m_.name = from_.name;
        m_.double_sided = from_.doubleSided;
        alpha();
        if (const auto* e = find_extension(from_.extensions, "KHR_materials_pbrSpecularGlossiness"))
            specular_glossiness(*e);
        else
            metallic_roughness();
        m_.normal_texture = texture(use_of(from_.normalTexture));
        m_.normal_scale = clamped("normalTexture.scale", from_.normalTexture.scale, -kMaxFloat, kMaxFloat);
        extensions();
        emission();
        choose_uv_sets();
        return std::move(result_);
    }

  private:
    float clamped(const char* field, double value, double lower, double upper) {
        if (!(value >= lower && value <= upper))
            document_.warnings.add(fmt::format("{} is outside [{}, {}], clamped", field, lower, upper), element_);
        return static_cast<float>(std::clamp(value, lower, upper));
    }
    float fraction(const char* field, double value) { return clamped(field, value, 0, 1); }
    float non_negative(const char* field, double value) { return clamped(field, value, 0, kMaxFloat); }
    vec3 non_negative(const char* field, const dvec3& v) {
        return {non_negative(field, v.x), non_negative(field, v.y), non_negative(field, v.z)};
    }
    vec4 fraction(const char* field, const dvec4& v) {
        return {fraction(field, v.x), fraction(field, v.y), fraction(field, v.z), fraction(field, v.w)};
    }

    Wrap wrap(int mode) {
        if (mode == TINYGLTF_TEXTURE_WRAP_CLAMP_TO_EDGE) return Wrap::clamp_to_edge;
        if (mode == TINYGLTF_TEXTURE_WRAP_MIRRORED_REPEAT) return Wrap::mirrored_repeat;
        if (mode != TINYGLTF_TEXTURE_WRAP_REPEAT)
            document_.warnings.add(fmt::format("wrap mode {} is unknown, taken as repeat", mode), element_);
        return Wrap::repeat;
    }

    /// uv_set is the file's TEXCOORD index until choose_uv_sets().
    TextureRef texture(const TextureUse& use) {
        TextureRef ref;
        if (use.index == kNone) return ref;
        const tinygltf::Texture& from = document_.model.textures[static_cast<std::size_t>(use.index)];
        if (from.source == kNone) {
            document_.warnings.add("has no PNG or JPEG image, it is not used", fmt::format("textures[{}]", use.index));
            return ref;
        }
        ref.image = from.source;
        ref.uv_set = use.tex_coord;
        if (from.sampler != kNone) {
            const tinygltf::Sampler& sampler = document_.model.samplers[static_cast<std::size_t>(from.sampler)];
            ref.wrap_u = wrap(sampler.wrapS);
            ref.wrap_v = wrap(sampler.wrapT);
            ref.nearest = sampler.magFilter == TINYGLTF_TEXTURE_FILTER_NEAREST;
        }
        if (use.transform) {
            ref.uv_transform = uv_transform(*use.transform);
            ref.uv_set = integer(*use.transform, "texCoord", ref.uv_set);
        }
        return ref;
    }

    void alpha() {
        if (from_.alphaMode == "MASK")
            m_.alpha_mode = AlphaMode::mask;
        else if (from_.alphaMode == "BLEND")
            m_.alpha_mode = AlphaMode::blend;
        else if (from_.alphaMode != "OPAQUE")
            document_.warnings.add(fmt::format("alphaMode '{}' is unknown, taken as OPAQUE", from_.alphaMode),
                                   element_);
        m_.alpha_cutoff = non_negative("alphaCutoff", from_.alphaCutoff);
    }

    void metallic_roughness() {
        const auto& pbr = from_.pbrMetallicRoughness;
        const auto& color = pbr.baseColorFactor;
        m_.base_color = fraction("baseColorFactor", dvec4(color[0], color[1], color[2], color[3]));
        m_.base_color_texture = texture(use_of(pbr.baseColorTexture));
        m_.metallic = fraction("metallicFactor", pbr.metallicFactor);
        m_.roughness = fraction("roughnessFactor", pbr.roughnessFactor);
        m_.metallic_roughness_texture = texture(use_of(pbr.metallicRoughnessTexture));
    }

    /// The same reflectances in our terms: a dielectric whose F0 is `specular`. Glossiness textures are turned into
    /// roughness by load_images().
    void specular_glossiness(const tinygltf::Value& e) {
        m_.base_color = fraction("diffuseFactor", vector(e, "diffuseFactor", dvec4(1)));
        m_.base_color_texture = texture(use_of(e, "diffuseTexture"));
        m_.metallic = 0;
        const float glossiness = fraction("glossinessFactor", number(e, "glossinessFactor", 1));
        m_.specular_color = non_negative("specularFactor", vector(e, "specularFactor", dvec3(1))) / float(kDefaultF0);
        m_.specular_color_texture = texture(use_of(e, "specularGlossinessTexture"));
        m_.roughness = 1 - glossiness;
        if (m_.specular_color_texture) result_.glossiness = glossiness;
    }

    void extensions() {
        if (const auto* e = find_extension(from_.extensions, "KHR_materials_ior")) {
            const double ior = number(*e, "ior", 1.5);
            // Zero means F0 = 1 at normal incidence; an infinite index would say the same.
            if (ior == 0)
                m_.specular_color /= float(kDefaultF0);
            else
                m_.ior = clamped("ior", ior, 1, kMaxFloat);
        }
        if (const auto* e = find_extension(from_.extensions, "KHR_materials_specular")) {
            m_.specular = fraction("specularFactor", number(*e, "specularFactor", 1));
            m_.specular_texture = texture(use_of(*e, "specularTexture"));
            m_.specular_color *= non_negative("specularColorFactor", vector(*e, "specularColorFactor", dvec3(1)));
            if (const TextureRef t = texture(use_of(*e, "specularColorTexture"))) m_.specular_color_texture = t;
        }
        if (const auto* e = find_extension(from_.extensions, "KHR_materials_clearcoat")) {
            m_.clearcoat = fraction("clearcoatFactor", number(*e, "clearcoatFactor", 0));
            m_.clearcoat_texture = texture(use_of(*e, "clearcoatTexture"));
            m_.clearcoat_roughness = fraction("clearcoatRoughnessFactor", number(*e, "clearcoatRoughnessFactor", 0));
            m_.clearcoat_roughness_texture = texture(use_of(*e, "clearcoatRoughnessTexture"));
            const TextureUse normal = use_of(*e, "clearcoatNormalTexture");
            m_.clearcoat_normal_texture = texture(normal);
            m_.clearcoat_normal_scale = clamped("clearcoatNormalTexture.scale", normal.scale, -kMaxFloat, kMaxFloat);
        }
        if (const auto* e = find_extension(from_.extensions, "KHR_materials_transmission")) {
            m_.transmission = fraction("transmissionFactor", number(*e, "transmissionFactor", 0));
            m_.transmission_texture = texture(use_of(*e, "transmissionTexture"));
        }
        m_.unlit = find_extension(from_.extensions, "KHR_materials_unlit") != nullptr;
    }

    void emission() {
        if (m_.unlit) return;  // shows its base colour and nothing else
        const auto& factor = from_.emissiveFactor;
        double strength = 1;
        if (const auto* e = find_extension(from_.extensions, "KHR_materials_emissive_strength"))
            strength = number(*e, "emissiveStrength", 1);
        m_.emission = non_negative("emission", strength * dvec3(factor[0], factor[1], factor[2]));
        m_.emission_texture = texture(use_of(from_.emissiveTexture));
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
    const tinygltf::Material& from_;
    const std::string element_;
    GltfMaterial result_;
    Material& m_ = result_.material;
};

}  // namespace

std::vector<GltfMaterial> convert_materials(GltfDocument& document) {
    std::vector<GltfMaterial> materials;
    for (std::size_t i = 0; i < document.model.materials.size(); ++i)
        materials.push_back(Converter(document, i).convert());
    return materials;
}

}  // namespace halflight
