// Light groups: which lights they have.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "api/halflight/scene_edits.h"

namespace halflight {

/// Light groups of a scene's objects, by index of the object; kNoLightGroup: that of all other lights.
struct FoundLightGroups {
    std::vector<std::uint32_t> lights, materials, instances;
    std::uint32_t environment = kNoLightGroup;
};

/// Returns the groups of SceneEdits::light_groups. A name means all lights, materials and nodes that have it, nodes
/// with everything below them; "light:NAME", "material:NAME" and "node:NAME" select a kind, and "environment" is the
/// environment. The first group that names an object has it. Throws Error about `subject` for names that find nothing,
/// for too many groups, and for names of groups that cannot name a layer.
FoundLightGroups find_light_groups(const SceneEdits& edits, const Scene& scene, const SceneTree& tree,
                                   const std::string& subject);

/// Sets the light groups of a scene, all but those of its instances. With SceneEdits::each_light, each light, each
/// material that emits light and the environment get a group. Throws Error about `subject` where these are too many.
void set_light_groups(const SceneEdits& edits, const FoundLightGroups& found, Scene& scene, const std::string& subject);

}  // namespace halflight
