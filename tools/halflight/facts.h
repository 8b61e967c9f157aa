// What a scene holds, what was mended, and what it takes to render it.
#pragma once

#include <nlohmann/json.hpp>

#include "engine/scene/scene.h"

namespace halflight {

/// Counts: meshes, instances, triangles (stored, and with every instance counted), materials, lights, ...
nlohmann::ordered_json scene_counts(const Scene& scene);

/// All that `halflight info SCENE` tells, but for the file itself.
nlohmann::ordered_json scene_facts(const Scene& scene);

}  // namespace halflight
