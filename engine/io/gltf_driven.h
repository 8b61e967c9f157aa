// What animations drive: where pointers lead, and the numbers in the model.
#pragma once

#include <compare>
#include <optional>
#include <string>
#include <vector>

#include "engine/io/gltf_document.h"
#include "engine/scene/animation.h"

namespace halflight {

struct GltfTarget {
    AnimatedProperty property = AnimatedProperty::translation;
    int index = 0;  // into the list of nodes, materials, lights or cameras
    auto operator<=>(const GltfTarget&) const = default;
};

/// Where a pointer of KHR_animation_pointer leads ("/materials/0/emissiveFactor"); none where it is well-formed and
/// nothing of ours. Throws Error about `element`: no JSON pointer, an index that the file does not have, a cone of a
/// light that is no spot, a field of view of a camera without one.
std::optional<GltfTarget> follow_pointer(const GltfDocument& document, const std::string& pointer,
                                         const std::string& element);

/// How many numbers it has; 0 of weights, whose mesh tells.
int components_of(AnimatedProperty property);

/// The numbers of a target as the model has them; none where it leaves them to the format's defaults.
std::vector<double> driven_values(const tinygltf::Model& model, const GltfTarget& target);
/// Puts others there.
void set_driven_values(tinygltf::Model& model, const GltfTarget& target, const std::vector<double>& values);

}  // namespace halflight
