#include "engine/scene/light_types.h"

#include <algorithm>
#include <array>

#include "shaders/shared/light.h"

namespace halflight {
namespace {

constexpr std::array kLightTypes = {
    LightTypeRow{LightType::point, "point", "candela", shared::kLightPoint, nullptr},
    LightTypeRow{LightType::spot, "spot", "candela", shared::kLightSpot, "SPOT_LIGHTS"},
    LightTypeRow{LightType::directional, "directional", "lux", shared::kLightDirectional, "DIRECTIONAL_LIGHTS"},
};

}  // namespace

std::span<const LightTypeRow> light_types() {
    return kLightTypes;
}

const LightTypeRow& row_of(LightType type) {
    return kLightTypes.at(static_cast<std::size_t>(type));
}

const LightTypeRow* find_light_type(std::string_view name) {
    const auto found =
        std::ranges::find_if(kLightTypes, [&](const LightTypeRow& row) { return std::string_view(row.name) == name; });
    return found == kLightTypes.end() ? nullptr : &*found;
}

}  // namespace halflight
