// The node tree with its lights and cameras.
#pragma once

#include <vector>

#include "engine/io/gltf/document.h"
#include "engine/scene/scene_tree.h"

namespace halflight {

struct GltfNodes {
    std::vector<dmat4> world;    // per node; affine, each element in the range of float32
    std::vector<bool> mirrored;  // per node: its world transform mirrors, with scales of 0 taken as 1
    std::vector<int> parents;    // per node; kNone: none
    std::vector<int> all;        // nodes of the scene, parents first, each once
    // Nodes of the scene that KHR_node_visibility does not hide, or that some animation may show. Cameras ignore it.
    std::vector<int> shown;
    std::vector<bool> hidden;  // per node: it or a node above is hidden now

    double side(std::size_t node) const { return mirrored[node] ? -1 : 1; }  ///< Returns Joint::side.
};

/// Computes the world transforms. Throws Error for a node with two parents, in a cycle, or with a transform beyond
/// float32's range.
GltfNodes resolve_nodes(GltfDocument& document);

/// Returns whether a node is a lamp, by KHR_lights_punctual or EXT_lights_ies.
bool is_light(const tinygltf::Node& node);

/// Returns whether float32 can represent all elements; false for NaN.
bool within_float_range(const dmat4& m);

/// Returns translation * rotation * scale. The rotation is a quaternion xyzw of any length; zero is no rotation.
dmat4 compose(const dvec3& translation, const dvec4& rotation, const dvec3& scale);

std::vector<Camera> convert_cameras(GltfDocument& document, const GltfNodes& nodes);
std::vector<PunctualLight> convert_lights(GltfDocument& document, const GltfNodes& nodes);
/// Returns the nodes, and the node of each light of convert_lights().
SceneTree convert_tree(const GltfDocument& document, const GltfNodes& nodes);

}  // namespace halflight
