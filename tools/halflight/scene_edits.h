// Changes of a scene's light and materials that leave its file alone.
#pragma once

#include <vector>

#include "engine/scene/scene.h"

namespace halflight {

struct SceneEdits {
    double environment_rotation = 0;  // degrees to the right, as seen from within; whole texels of the map
    float environment_intensity = 1;  // factor, >= 0
    float emission = 1;               // factor of all emissive surfaces, >= 0
    std::vector<float> lights{};      // factors of Scene::lights, >= 0; 1 where there are fewer
    bool clay = false;                // every surface is of one grey, rough and without texture; lights stay
    bool operator==(const SceneEdits&) const = default;
};

/// Of a scene that has no edits yet.
void apply(const SceneEdits& edits, Scene& scene);

}  // namespace halflight
