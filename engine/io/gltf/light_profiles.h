// EXT_lights_ies: lamps with profiles.
#pragma once

#include "engine/io/gltf/nodes.h"

namespace halflight {

/// Reads the profiles of a list of the file, checked, that nodes use. Elements with the same URI or buffer view share
/// one. Warns of those without light. Throws Error about a profile that cannot be read, and for profiles that do not fit
/// into the memory budget.
void read_light_profiles(const nlohmann::json& list, GltfDocument& document);

/// Returns the reference of a node to a profile; null if it has none.
const tinygltf::Value* find_profile_light(const tinygltf::Node& node);

/// Returns the name of the profile of a node's reference.
std::string name_of_profile(const GltfDocument& document, const tinygltf::Value& reference);

/// Returns the lamp of a node's reference, without position and axes. Its greatest intensity is that of the profile
/// times `multiplier` and `color`.
PunctualLight convert_profile_light(GltfDocument& document, const tinygltf::Value& reference, std::size_t node);

}  // namespace halflight
