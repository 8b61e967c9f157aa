// Light groups: which lights they have.
#pragma once

#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include "api/halflight/scene_edits.h"

namespace halflight {

/// Light groups of a scene's objects, by index of the object; kNoLightGroup: that of all other lights.
struct FoundLightGroups {
    std::vector<std::uint32_t> lights, materials, instances;
    std::uint32_t environment = kNoLightGroup;
};

/// The groups of SceneEdits::each_light, which all poses of a scene share.
struct SeparateLights {
    std::vector<std::string> names;     // names of the groups; the last group has all other lights
    FoundLightGroups groups;            // groups of lights, materials and environment; `instances` is empty
    std::vector<std::string> surfaces;  // names of all materials
};

/// Throws Error about `subject` if the name of a group cannot name a layer.
void check_light_group_name(const std::string& name, const std::string& subject);

/// Returns the groups of SceneEdits::light_groups. A name means all lights, materials and nodes that have it, nodes
/// with everything below them; "light:NAME", "material:NAME" and "node:NAME" select a kind, and "environment" is the
/// environment. The first group that names an object has it. Throws Error about `subject` for names that find nothing,
/// for too many groups, and for names of groups that cannot name a layer.
FoundLightGroups find_light_groups(const SceneEdits& edits, const Scene& scene, const SceneTree& tree,
                                   const std::string& subject);

/// Sets the light groups of SceneEdits::light_groups, all but those of instances.
void set_light_groups(const SceneEdits& edits, const FoundLightGroups& found, Scene& scene);

/// Gives each light, each material that emits light and the environment a group of its own. `driven` holds indices of
/// materials that may emit light in other poses. Throws Error about `subject` if these are too many.
SeparateLights separate_lights(const Scene& scene, const std::set<std::size_t>& driven, const std::string& subject);
/// Throws Error about the scene if a pose has other materials: surfaces of added lights that are black have none.
void set_light_groups(const SeparateLights& lights, Scene& scene);

/// Returns the names of groups that have no light, but for `driven` materials. Those of pages cannot be told.
std::vector<std::string> dark_light_groups(const Scene& scene, const std::set<std::size_t>& driven);

}  // namespace halflight
