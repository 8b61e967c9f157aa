// Changes of a scene's light and materials that leave its file alone.
#pragma once

#include <optional>
#include <vector>

#include "engine/scene/scene.h"

namespace halflight {

inline constexpr double kFarLight = 1e12;  ///< of coordinates of lights

/// Of a punctual light.
struct LightEdit {
    float factor = 1;  // of its intensity, >= 0
    // In place of its own:
    std::optional<vec3> color{};       // linear Rec.709, [0,1]; white is as bright as its largest channel
    std::optional<dvec3> position{};   // world, up to kFarLight; means nothing to directional lights
    std::optional<dvec3> direction{};  // unit, the way the light travels; nothing to points
    bool operator==(const LightEdit&) const = default;
};

struct SceneEdits {
    double environment_rotation = 0;  // degrees to the right, as seen from within; whole texels of the map
    float environment_intensity = 1;  // factor, >= 0
    vec3 environment_tint{1};         // factor by channel, linear Rec.709, [0,1]
    float emission = 1;               // factor of all emissive surfaces, >= 0
    std::vector<LightEdit> lights{};  // of Scene::lights; none where there are fewer
    bool clay = false;                // every surface is of one grey, rough and without texture; lights stay
    bool operator==(const SceneEdits&) const = default;
};

/// The colour and the intensity (cd or lux) whose product the light has; the colour's largest channel is 1, or it is
/// white where the light is off.
struct LightColor {
    vec3 color;
    float intensity;
};
LightColor color_of(const PunctualLight& light);

/// The same direction with length 1; none where there is none.
std::optional<dvec3> unit_direction(const dvec3& v);

/// Of a scene that has no edits yet.
void apply(const SceneEdits& edits, Scene& scene);

}  // namespace halflight
