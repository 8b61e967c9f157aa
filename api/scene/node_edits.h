// Edits of nodes: their transforms, what is hidden, and what catches shadows.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "api/halflight/scene_edits.h"

namespace halflight {

/// Objects of a scene after edits of nodes.
struct MovedObjects {
    std::vector<PunctualLight> lights;       // all lights, moved
    std::vector<Instance> instances;         // instances that are not hidden, moved, with Instance::catcher
    std::vector<std::size_t> hidden_lights;  // indices of lights that are hidden
};

/// Returns for each node whether it or a node below it has a surface or a light, so that an edit can move it.
std::vector<bool> movable_nodes(const Scene& scene, const SceneTree& tree);

/// Returns the lights and instances of a scene as edits of nodes, hidden names and shadow catchers change them. Throws
/// Error about `subject` for names that find nothing that can move or catch shadows, for values outside their ranges
/// and for transforms that cannot be replaced.
MovedObjects move_objects(const SceneEdits& edits, const Scene& scene, const SceneTree& tree,
                          const std::string& subject);

/// Returns for each instance whether one of the nodes is its own or above it, or one of the names finds it, its mesh or
/// a node above it. Names that find nothing are ignored.
std::vector<bool> instances_below(const std::vector<std::string>& nodes, const std::vector<std::string>& names,
                                  const Scene& scene, const SceneTree& tree);

/// Returns the index of the node of an instance or a light; kNone if it has none.
int node_of_instance(const Scene& scene, const SceneTree& tree, std::size_t index);
int node_of_light(const SceneTree& tree, std::size_t index);

/// Throws Error about `subject` if a value is outside its range, or the matrix cannot be inverted.
void check_values(const NodeEdit& edit, const std::string& subject);

}  // namespace halflight
