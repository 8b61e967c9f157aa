#include "engine/scene/light_types.h"

#include <algorithm>
#include <array>

#include "shaders/shared/light.h"

namespace halflight {
namespace {

using L = PunctualLight;
using N = LightNeeds;

constexpr std::array kLightTypes = {
    LightTypeRow{.type = LightType::point,
                 .name = "point",
                 .unit = "candela",
                 .kind = shared::kLightPoint,
                 .need = nullptr,
                 .has_direction = false},
    LightTypeRow{.type = LightType::spot,
                 .name = "spot",
                 .unit = "candela",
                 .kind = shared::kLightSpot,
                 .need = &N::spot_lights},
    LightTypeRow{.type = LightType::directional,
                 .name = "directional",
                 .unit = "lux",
                 .kind = shared::kLightDirectional,
                 .need = &N::directional_lights,
                 .has_position = false},
};

constexpr PropertyRange kCone{0, float(kPi / 2)};  // float32 rounds pi/2 upwards

constexpr std::array kProperties = {
    LightProperty{"inner_cone", &L::inner_cone, "/spot/innerConeAngle", kCone},
    LightProperty{"outer_cone", &L::outer_cone, "/spot/outerConeAngle", kCone},
    LightProperty{"radius", &L::radius, nullptr, {0, kMostRadius}},
    LightProperty{"angle", &L::angle, nullptr, {0, kMostAngle}},
};

constexpr std::array kFeatures = {
    LightFeature{"area lights", &N::area_lights, "AREA_LIGHTS", "no triangle is a light"},
    LightFeature{"punctual lights", &N::punctual_lights, "PUNCTUAL_LIGHTS", "there are none to choose from"},
    LightFeature{"spot cones", &N::spot_lights, "SPOT_LIGHTS", "there is no spot light", &N::punctual_lights},
    LightFeature{"directional lights", &N::directional_lights, "DIRECTIONAL_LIGHTS", "there are none to choose from",
                 &N::punctual_lights},
    LightFeature{"light profiles", &N::light_profiles, "LIGHT_PROFILES", "no lamp has one (IES files)",
                 &N::punctual_lights},
    LightFeature{"sized lamps", &N::sized_lamps, "SIZED_LAMPS", "no point or spot has a radius", &N::punctual_lights},
    LightFeature{"sized suns", &N::sized_suns, "SIZED_SUNS", "no directional light has an angle"},
    LightFeature{"sun apart", &N::sun, "SUN",
                 "there is no directional light beside others, or another choice was asked for"},
    LightFeature{"choice of a light", &N::light_choice, "LIGHT_CHOICE", "there is one light at most"},
    LightFeature{"light tree", &N::light_tree, "LIGHT_TREE",
                 "there are no two lights for it, or another choice was asked for", &N::light_choice},
    LightFeature{"light links", &N::light_links, "LIGHT_LINKS", "each light lights all objects"},
    LightFeature{"shadow links", &N::shadow_links, "SHADOW_LINKS", "all objects cast the shadows of each light",
                 &N::light_links},
    LightFeature{"environment", &N::environment, "ENVIRONMENT", "the environment is black"},
    LightFeature{"environment map", &N::environment_map, "ENVIRONMENT_MAP", "the environment is of one colour",
                 &N::environment},
};

}  // namespace

std::span<const LightTypeRow> light_types() {
    return kLightTypes;
}

std::span<const LightProperty> light_properties() {
    return kProperties;
}

std::span<const LightFeature> light_features() {
    return kFeatures;
}

const LightTypeRow& row_of(LightType type) {
    return kLightTypes.at(static_cast<std::size_t>(type));
}

const LightTypeRow* find_light_type(std::string_view name) {
    const auto found =
        std::ranges::find_if(kLightTypes, [&](const LightTypeRow& row) { return std::string_view(row.name) == name; });
    return found == kLightTypes.end() ? nullptr : &*found;
}

void complete(LightNeeds& needs) {
    for (const LightFeature& feature : kFeatures)
        if (needs.*feature.need && feature.implies) needs.*feature.implies = true;
}

}  // namespace halflight
