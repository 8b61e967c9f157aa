#include "engine/tables/needs.h"

#include <algorithm>
#include <array>

#include "engine/scene/light_types.h"
#include "engine/scene/material_properties.h"
#include "shaders/shared/reuse_groups.h"
#include "shaders/shared/surface_rows.h"

namespace halflight {
namespace {

using N = SceneNeeds;

constexpr std::array kGeometry = {
    SceneNeed{"instance transforms", &N::instances, "INSTANCES", "all triangles are in world space"},
    SceneNeed{"vertex colours", &N::vertex_colors, "VERTEX_COLORS", "no vertex has any but white"},
    SceneNeed{"alpha tests", &N::alpha, "ALPHA", "alpha decides no hit"},
    SceneNeed{"double precision for slivers", &N::slivers, "SLIVERS",
              "no triangle is more than 2000 times as long as high"},
    SceneNeed{"shadow catchers", &N::catchers, "CATCHERS", "no object is one"},
    SceneNeed{"tests of back faces", &N::one_sided, "ONE_SIDED", "no opaque material is single-sided"},
    SceneNeed{"light through panes", &N::panes, "PANES", "no material is a pane of clear glass"},
    SceneNeed{"light straight through solids", &N::solid_panes, "SOLID_PANES", "no clear solid has straight_shadows"},
};

constexpr std::array kLightSampling = {
    SceneNeed{"every light", &N::every_light, "EVERY_LIGHT",
              "there is one light or there are too many, or another choice was asked for"},
};

constexpr std::array kLookups = {
    SceneNeed{"texture coordinates", &N::texture_coordinates, "TEXTURES", "there are no textures"},
    SceneNeed{"tangents", &N::normal_maps, "NORMAL_MAPS", "there is no normal map and no anisotropy to go with them"},
    SceneNeed{"texture transforms", &N::texture_transforms, "TEXTURE_TRANSFORMS", "no texture has one"},
    SceneNeed{"second texture coordinates", &N::texture_uv_set_1, "TEXTURE_UV_SET_1", "no texture uses them"},
    SceneNeed{"mirrored repeat", &N::texture_mirrored, "TEXTURE_MIRRORED", "no texture repeats so"},
    SceneNeed{"clamped textures", &N::texture_clamped, "TEXTURE_CLAMPED", "no texture ends at its edges"},
    SceneNeed{"nearest texels", &N::texture_nearest, "TEXTURE_NEAREST", "no texture is looked up so"},
    SceneNeed{"16-bit texels", &N::texture_deep, "TEXTURE_DEEP", "no texture of data has 16 bits"},
    SceneNeed{"mip levels", &N::texture_levels, "TEXTURE_LEVELS", "no texture has any (--texture-lod)"},
};

/// Returns the needs that follow from `n` and `n` itself.
SceneNeeds completed(SceneNeeds n) {
    for (const MaterialTexture& texture : material_textures()) {
        n.texture_coordinates |= n.*texture.need;
        n.normal_maps |= n.*texture.need && needs_tangents(texture.use);
    }
    for (const MaterialLobe& lobe : material_lobes()) n.normal_maps |= n.*lobe.need && lobe.tangents;
    n.texture_coordinates |= n.normal_maps;  // the handedness of tangents is stored beside texture coordinates
    n.emission |= n.area_lights;
    n.light_choice |= n.every_light;
    n.diffuse |= n.catchers;  // they reflect light diffusely (make_catcher() in shaders/lib/bsdf_record.glsl)
    complete(static_cast<MaterialNeeds&>(n));
    complete(static_cast<LightNeeds&>(n));
    return n;
}

}  // namespace

std::span<const SceneNeed> known_scene_needs() {
    static const std::vector<SceneNeed> needs = [] {
        std::vector<SceneNeed> all(kGeometry.begin(), kGeometry.end());
        for (const MaterialLobe& l : material_lobes()) all.push_back({l.label, l.need, l.define, l.fact});
        for (const LightFeature& l : light_features()) all.push_back({l.label, l.need, l.define, l.fact});
        all.insert(all.end(), kLightSampling.begin(), kLightSampling.end());
        for (const MaterialTexture& t : material_textures()) all.push_back({t.label, t.need, t.define, t.fact});
        all.insert(all.end(), kLookups.begin(), kLookups.end());
        return all;
    }();
    return needs;
}

SceneNeeds united(SceneNeeds a, const SceneNeeds& b) {
    for (const SceneNeed& need : known_scene_needs()) a.*need.flag = a.*need.flag || b.*need.flag;
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
    return need.flag != &N::environment_map && need.flag != &N::light_tree && need.flag != &N::every_light &&
           need.flag != &N::sun && need.flag != &N::slivers && need.flag != &N::texture_levels &&
           need.flag != &N::catchers && need.flag != &N::solid_panes &&  // a bias that pictures name
           need.flag != &N::light_links && need.flag != &N::shadow_links;
}

SceneNeeds kept_needs(const Kept& kept) {
    SceneNeeds needs;
    for (const SceneNeed& need : known_scene_needs()) needs.*need.flag = can_be_kept(need) && kept.has(need.name);
    return completed(needs);
}

int SceneNeeds::vertex_stride() const {
    return 1 + (texture_coordinates ? 1 : 0) + (normal_maps ? 1 : 0) + (vertex_colors ? 1 : 0);
}

std::size_t SceneNeeds::surface_record_bytes() const {
    return static_cast<std::size_t>(record_rows(*this) + (light_links ? 1 : 0)) * sizeof(vec4);
}

std::size_t SceneNeeds::reuse_point_bytes() const {
    return sizeof(shared::ReusePoint) + static_cast<std::size_t>(layer_rows(*this)) * sizeof(vec4);
}

std::vector<std::pair<std::string, std::string>> shader_defines(const SceneNeeds& needs) {
    std::vector<std::pair<std::string, std::string>> defines;
    const auto define = [&](const std::string& name, const std::string& value) {
        defines.emplace_back("HALFLIGHT_" + name, value);
    };
    for (const SceneNeed& need : known_scene_needs())
        if (needs.*need.flag) define(need.define, "1");
    if (needs.lights()) define("LIGHTS", "1");
    if (needs.receivers()) define("RECEIVERS", "1");
    if (needs.sized_lights()) define("SIZED_LIGHTS", "1");
    define("VERTEX_STRIDE", std::to_string(needs.vertex_stride()));
    int row = shared::kLeastSurfaceRows, layer = 2;
    for (const MaterialLobe& lobe : material_lobes()) {
        if (!(needs.*lobe.need)) continue;
        if (lobe.record_rows > 0) define(lobe.define + std::string("_ROW"), std::to_string(row - shared::kBsdfRow));
        if (lobe.layer_rows > 0) define(lobe.define + std::string("_LAYER"), std::to_string(layer));
        row += lobe.record_rows, layer += lobe.layer_rows;
    }
    define("SURFACE_ROWS", std::to_string(row + (needs.light_links ? 1 : 0)));
    define("LAYER_ROWS", std::to_string(layer));
    std::sort(defines.begin(), defines.end());
    return defines;
}

}  // namespace halflight
