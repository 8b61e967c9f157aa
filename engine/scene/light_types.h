// The tables of lights. Types of punctual lights have names in glTF, units and codes for the GPU; their numbers have
// ranges. Features of lights are compiled into shaders if a scene needs them. The tables drive the glTF reader,
// validation, the light tables, the needs of a scene, `halflight info`, the Python module and the viewer.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

#include "engine/scene/property_range.h"
#include "engine/scene/scene.h"

namespace halflight {

struct LightTypeRow {
    LightType type;
    const char* name;        // type in KHR_lights_punctual
    const char* unit;        // unit of PunctualLight::intensity
    std::uint32_t kind;      // code in light rows (shaders/shared/light.h)
    bool LightNeeds::*need;  // need that the type has beside punctual_lights; null: none
    bool has_position = true;
    bool has_direction = true;
};

inline constexpr float kMostRadius = 1e9f;                   ///< metres
inline constexpr float kMostAngle = float(kPi) * 179 / 180;  ///< radians

/// A number of a punctual light. Types that do not use it keep the default.
struct LightProperty {
    const char* name;  // the member of PunctualLight
    float PunctualLight::*field;
    const char* path;  // JSON pointer within a glTF light; null: read from its extras (engine/io/gltf/extras.h)
    PropertyRange range;
};

/// A feature of lights that shaders leave out if the scene does not need it.
struct LightFeature {
    const char* label;  // name of the need
    bool LightNeeds::*need;
    const char* define;                   // name of the macro after HALFLIGHT_
    const char* fact;                     // statement that is true if the need is false
    bool LightNeeds::*implies = nullptr;  // a second need that follows from `need`; null: none
};

/// Returns one row per type, in the order of LightType.
std::span<const LightTypeRow> light_types();
std::span<const LightProperty> light_properties();
std::span<const LightFeature> light_features();

/// Returns the row of a type.
const LightTypeRow& row_of(LightType type);
/// Returns the row of a name in glTF, or null.
const LightTypeRow* find_light_type(std::string_view name);

/// Adds the needs that others imply: a spot needs punctual lights.
void complete(LightNeeds& needs);

}  // namespace halflight
