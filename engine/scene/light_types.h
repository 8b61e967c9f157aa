// The table of punctual light types: their names in glTF, units, and codes for the GPU. It drives the glTF reader, the
// light tables, the needs of a scene and `halflight info`.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

#include "engine/scene/scene.h"

namespace halflight {

struct LightTypeRow {
    LightType type;
    const char* name;     // type in KHR_lights_punctual
    const char* unit;     // unit of PunctualLight::intensity
    std::uint32_t kind;   // code in light rows (shaders/shared/light.h)
    const char* feature;  // macro of the need that the type has (engine/tables/needs.h); null: none
};

/// Returns one row per type, in the order of LightType.
std::span<const LightTypeRow> light_types();

/// Returns the row of a type.
const LightTypeRow& row_of(LightType type);
/// Returns the row of a name in glTF, or null.
const LightTypeRow* find_light_type(std::string_view name);

}  // namespace halflight
