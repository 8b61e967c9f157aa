// What animations drive: where pointers lead, and the numbers in the model.
#pragma once

#include <compare>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/io/gltf/document.h"
#include "engine/scene/animation.h"

namespace halflight {

/// Numbers of an object of the file that can be driven.
struct GltfTarget {
    int field = 0;  // which of its numbers
    int index = 0;  // into the file's list of nodes, meshes, materials, lights or cameras
    auto operator<=>(const GltfTarget&) const = default;
};

/// Where a pointer of KHR_animation_pointer leads ("/materials/0/emissiveFactor"); none where it is well-formed and
/// nothing of ours. Throws Error about `element`: no JSON pointer, an index that the file does not have, a cone of a
/// light that is no spot, a perspective of a camera without one, specular-glossiness of a material without it.
std::optional<GltfTarget> follow_pointer(const GltfDocument& document, const std::string& pointer,
                                         const std::string& element);
/// The same of a channel's path without a pointer ("rotation"); none where it is unknown.
std::optional<GltfTarget> node_target(std::string_view path, int node);

AnimatedProperty property_of(const GltfTarget& target);
/// How many numbers it has; 0 of weights, whose mesh tells.
int components_of(const GltfTarget& target);

/// The numbers of a target as the model has them, or the format's defaults. Of a list that is not there: none.
std::vector<double> driven_values(const tinygltf::Model& model, const GltfTarget& target);
/// Puts others there.
void set_driven_values(tinygltf::Model& model, const GltfTarget& target, const std::vector<double>& values);

}  // namespace halflight
