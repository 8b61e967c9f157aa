// The fields of a document that animations drive: targets of pointers, and access to the numbers.
#pragma once

#include <compare>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "engine/io/gltf/document.h"
#include "engine/scene/animation.h"

namespace halflight {

/// A field of an object of the file that animations can drive.
struct GltfTarget {
    int field = 0;  // row of the table of fields
    int index = 0;  // index into the file's list of nodes, meshes, materials, lights or cameras
    auto operator<=>(const GltfTarget&) const = default;
};

/// Returns the target of a pointer of KHR_animation_pointer ("/materials/0/emissiveFactor"); none if the pointer is
/// well-formed but leads to nothing that the loader drives. Throws Error about `element` for
///   - text that is no JSON pointer, or an index beyond the file's list,
///   - a cone of a light that is no spot, or a projection that the camera does not have,
///   - specular-glossiness of a material without it.
std::optional<GltfTarget> follow_pointer(const GltfDocument& document, const std::string& pointer,
                                         const std::string& element);
/// Returns the nodes whose visibility some animation drives. The animations need not be valid.
std::set<int> switched_nodes(const nlohmann::json& animations, std::size_t nodes);
/// Returns the target of a channel without a pointer, by its path ("rotation"); none if the path is unknown.
std::optional<GltfTarget> node_target(std::string_view path, int node);

AnimatedProperty property_of(const GltfTarget& target);
/// Returns the number of components; 0 for weights, whose number depends on the mesh.
int components_of(const GltfTarget& target);

/// Returns the target's numbers as the document has them, or the format's defaults; empty for weights that it lacks.
std::vector<double> driven_values(const GltfDocument& document, const GltfTarget& target);
/// Changes the target's numbers in the document.
void set_driven_values(GltfDocument& document, const GltfTarget& target, const std::vector<double>& values);

}  // namespace halflight
