#include "engine/tables/needs.h"

#include <algorithm>
#include <array>

namespace halflight {
namespace {

using N = SceneNeeds;

constexpr std::array kNeeds = {
    SceneNeed{"instance transforms", &N::instances, "INSTANCES", "all triangles are in world space"},
    SceneNeed{"vertex colours", &N::vertex_colors, "VERTEX_COLORS", "no vertex has any but white"},
    SceneNeed{"alpha tests", &N::alpha, "ALPHA", "alpha decides no hit"},
    SceneNeed{"double precision for needles", &N::slivers, "SLIVERS",
              "no triangle is more than 2000 times as long as high"},
    SceneNeed{"unlit surfaces", &N::unlit, "UNLIT", "no material is unlit"},
    SceneNeed{"diffuse lobe", &N::diffuse, "DIFFUSE", "no material has a diffuse component"},
    SceneNeed{"glossy lobe", &N::glossy, "GLOSSY", "no material has a specular, coat or transmission component"},
    SceneNeed{"clearcoat", &N::clearcoat, "CLEARCOAT", "no material has a coat"},
    SceneNeed{"transmission", &N::transmission, "TRANSMISSION", "no material transmits light"},
    SceneNeed{"specular colour", &N::specular_color, "SPECULAR_COLOR", "every dielectric reflects white"},
    SceneNeed{"emission", &N::emission, "EMISSION", "no surface glows"},
    SceneNeed{"area lights", &N::area_lights, "AREA_LIGHTS", "no triangle is a light"},
    SceneNeed{"punctual lights", &N::punctual_lights, "PUNCTUAL_LIGHTS", "there are none to choose from"},
    SceneNeed{"spot cones", &N::spot_lights, "SPOT_LIGHTS", "there is no spot light"},
    SceneNeed{"directional lights", &N::directional_lights, "DIRECTIONAL_LIGHTS", "there are none to choose from"},
    SceneNeed{"sun apart", &N::sun, "SUN",
              "there is no directional light beside others, or another choice was asked for"},
    SceneNeed{"choice of a light", &N::light_choice, "LIGHT_CHOICE", "there is one light at most"},
    SceneNeed{"light tree", &N::light_tree, "LIGHT_TREE", "there are few lights, or another choice was asked for"},
    SceneNeed{"environment", &N::environment, "ENVIRONMENT", "the environment is black"},
    SceneNeed{"environment map", &N::environment_map, "ENVIRONMENT_MAP", "the environment is of one colour"},
    SceneNeed{"base colour textures", &N::base_color_texture, "TEXTURE_BASE_COLOR", "no material has one"},
    SceneNeed{"metallic-roughness textures", &N::metallic_roughness_texture, "TEXTURE_METALLIC_ROUGHNESS",
              "no material has one"},
    SceneNeed{"normal maps", &N::normal_texture, "TEXTURE_NORMAL", "no material has one, or no mesh tangents"},
    SceneNeed{"emission textures", &N::emission_texture, "TEXTURE_EMISSION", "no material that glows has one"},
    SceneNeed{"specular textures", &N::specular_texture, "TEXTURE_SPECULAR", "no material has one"},
    SceneNeed{"specular colour textures", &N::specular_color_texture, "TEXTURE_SPECULAR_COLOR", "no material has one"},
    SceneNeed{"coat textures", &N::clearcoat_texture, "TEXTURE_CLEARCOAT", "no coat has one"},
    SceneNeed{"coat roughness textures", &N::clearcoat_roughness_texture, "TEXTURE_CLEARCOAT_ROUGHNESS",
              "no coat has one"},
    SceneNeed{"coat normal maps", &N::clearcoat_normal_texture, "TEXTURE_CLEARCOAT_NORMAL",
              "no coat has one, or no mesh tangents"},
    SceneNeed{"transmission textures", &N::transmission_texture, "TEXTURE_TRANSMISSION", "no material has one"},
    SceneNeed{"texture coordinates", &N::texture_coordinates, "TEXTURES", "there are no textures"},
    SceneNeed{"tangents", &N::normal_maps, "NORMAL_MAPS", "there is no normal map to go with them"},
    SceneNeed{"texture transforms", &N::texture_transforms, "TEXTURE_TRANSFORMS", "no texture has one"},
    SceneNeed{"second texture coordinates", &N::texture_uv_set_1, "TEXTURE_UV_SET_1", "no texture uses them"},
    SceneNeed{"mirrored repeat", &N::texture_mirrored, "TEXTURE_MIRRORED", "no texture repeats so"},
    SceneNeed{"clamped textures", &N::texture_clamped, "TEXTURE_CLAMPED", "no texture ends at its edges"},
    SceneNeed{"nearest texels", &N::texture_nearest, "TEXTURE_NEAREST", "no texture is looked up so"},
};

SceneNeeds completed(SceneNeeds n) {
    n.emission |= n.unlit || n.area_lights || n.emission_texture;
    n.punctual_lights |= n.spot_lights || n.directional_lights;
    n.clearcoat |= n.clearcoat_texture || n.clearcoat_roughness_texture || n.clearcoat_normal_texture;
    n.transmission |= n.transmission_texture;
    n.specular_color |= n.specular_color_texture;
    n.normal_maps |= n.normal_texture || n.clearcoat_normal_texture;
    n.glossy |= n.clearcoat || n.transmission || n.specular_color || n.specular_texture;
    n.texture_coordinates |= n.normal_maps ||  // whose handedness lies beside them
                             n.base_color_texture || n.metallic_roughness_texture || n.emission_texture ||
                             n.specular_texture || n.specular_color_texture || n.clearcoat_texture ||
                             n.clearcoat_roughness_texture || n.transmission_texture;
    n.environment |= n.environment_map;
    n.light_choice |= n.light_tree;
    return n;
}

}  // namespace

std::span<const SceneNeed> known_scene_needs() {
    return kNeeds;
}

SceneNeeds united(SceneNeeds a, const SceneNeeds& b) {
    for (const SceneNeed& need : kNeeds) a.*need.flag = a.*need.flag || b.*need.flag;
    return completed(a);
}

Kept Kept::everything() {
    Kept kept;
    kept.everything_ = true;
    return kept;
}

std::string Kept::text() const {
    if (everything_) return "everything";
    std::string text;
    for (const std::string& name : names_) text += (text.empty() ? "" : ",") + name;
    return text.empty() ? "nothing" : text;
}

bool can_be_kept(const SceneNeed& need) {
    return need.flag != &N::environment_map && need.flag != &N::light_tree && need.flag != &N::sun &&
           need.flag != &N::slivers;
}

SceneNeeds kept_needs(const Kept& kept) {
    SceneNeeds needs;
    for (const SceneNeed& need : kNeeds) needs.*need.flag = can_be_kept(need) && kept.has(need.name);
    return completed(needs);
}

int SceneNeeds::vertex_stride() const {
    return 1 + (texture_coordinates ? 1 : 0) + (normal_maps ? 1 : 0) + (vertex_colors ? 1 : 0);
}

std::vector<std::pair<std::string, std::string>> shader_defines(const SceneNeeds& needs) {
    std::vector<std::pair<std::string, std::string>> defines;
    const auto define = [&](const char* name, const std::string& value) {
        defines.emplace_back(std::string("HALFLIGHT_") + name, value);
    };
    for (const SceneNeed& need : kNeeds)
        if (needs.*need.flag) define(need.define, "1");
    if (needs.lights()) define("LIGHTS", "1");
    define("VERTEX_STRIDE", std::to_string(needs.vertex_stride()));
    std::sort(defines.begin(), defines.end());
    return defines;
}

}  // namespace halflight
