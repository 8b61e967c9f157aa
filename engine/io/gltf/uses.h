// Objects of a glTF file that its scene uses. Faults of other objects do not change the picture.
#pragma once

#include <cstddef>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace halflight {

/// Marks per object, by the list that holds it: "nodes", "accessors", "lights" and so on.
using GltfUses = std::map<std::string, std::vector<bool>, std::less<>>;

/// Returns the objects to which the scene refers, directly or through others. A material that only a variant names is
/// not used. Files without nodes are not scenes, and use all that they have. `root` has passed check_gltf();
/// `animations` are unchecked, and use the accessors of their samplers.
GltfUses find_uses(const nlohmann::json& root, const nlohmann::json& animations);

/// Returns whether an object is used.
inline bool is_used(const GltfUses& uses, std::string_view list, std::size_t index) {
    const auto found = uses.find(list);
    return found != uses.end() && index < found->second.size() && found->second[index];
}

}  // namespace halflight
