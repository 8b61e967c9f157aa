// Edits of a scene's lights, materials and transforms, which leave its file unchanged.
#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "engine/scene/scene.h"

namespace halflight {

/// Range of a number of an edit, inclusive.
struct EditRange {
    double lower, upper;
};
inline constexpr EditRange kLineWidth{1e-9, 1e9};       ///< diameter of points and lines, world units
inline constexpr EditRange kEditFactor{0, 1e9};         ///< factors of intensities and of emission
inline constexpr EditRange kEditColor{0, 1};            ///< channels of colours and tints, linear Rec.709
inline constexpr EditRange kEditPosition{-1e12, 1e12};  ///< coordinates of lights, metres
inline constexpr EditRange kEditRotation{-1e6, 1e6};    ///< degrees

/// Edit of one punctual light. Optional members replace the light's own value.
struct LightEdit {
    float factor = 1;                  // factor of the intensity, kEditFactor
    std::optional<vec3> color{};       // colour, kEditColor; white has the intensity of the light's largest channel
    std::optional<dvec3> position{};   // world position, kEditPosition; without effect on directional lights
    std::optional<dvec3> direction{};  // unit, direction in which light travels; without effect on point lights
    bool operator==(const LightEdit&) const = default;
};

struct SceneEdits {
    double environment_rotation = 0;  // degrees to the right, seen from inside, kEditRotation; rounded to whole texels
    float environment_intensity = 1;  // factor, kEditFactor
    vec3 environment_tint{1};         // factor by channel, kEditColor
    float emission = 1;               // factor of the emission of all surfaces, kEditFactor
    std::vector<LightEdit> lights{};  // edits of Scene::lights, by index; surplus entries are ignored
    bool clay = false;                // gives every surface one rough grey without texture; lights stay
    // Properties by index into Scene::materials, then by name (engine/scene/material_properties.h: "roughness",
    // "base_color"), one value for each component. They replace animated values at all times.
    std::map<std::size_t, std::map<std::string, std::vector<float>>> materials{};
    // object_to_world by index into Scene::instances, affine. They replace animated transforms at all times.
    std::map<std::size_t, dmat4> transforms{};
    bool operator==(const SceneEdits&) const = default;
};

/// Colour and intensity (cd or lux) of a light, whose product is PunctualLight::intensity.
struct LightColor {
    vec3 color;       // colour, largest channel 1; white where the light is off
    float intensity;  // >= 0
};
LightColor color_of(const PunctualLight& light);

/// Returns v scaled to length 1; none where v is zero or not finite.
std::optional<dvec3> unit_direction(const dvec3& v);

/// Checks whether edits suit a scene. Throws Error for unknown indices and properties, values outside their ranges,
/// directions that are not unit, and transforms that are not affine. The error names `source` (the file of the edits;
/// empty: none), the scene, and the light, material or instance.
void check_edits(const SceneEdits& edits, const Scene& scene, const std::string& source = {});

/// Applies edits to a scene that has none yet, except for the same transforms. Throws Error as check_edits() does, and
/// then leaves the scene unchanged.
void apply(const SceneEdits& edits, Scene& scene, const std::string& source = {});

}  // namespace halflight
