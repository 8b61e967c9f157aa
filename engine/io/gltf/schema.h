// The schema of glTF's JSON: properties, their types, and the targets of their indices.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

namespace halflight {

/// Parses JSON. Throws Error that names `file` for invalid JSON, for too deep nesting, and where the memory budget has
/// too little left for its values.
nlohmann::json parse_gltf_json(std::string_view text, const std::string& file);

/// Checks all properties that the loader reads for the rest pose. Later code then finds values of the right type,
/// arrays of the right length and indices in range. Removes all other properties. Whole numbers written as 3.0 become
/// integers, and numbers in real properties become floating point. Throws Error that names `file` and the property.
void check_gltf(nlohmann::json& root, const std::string& file);

/// Checks animations[index], which check_gltf() ignores: a damaged animation must prevent neither the rest pose nor the
/// other animations. The samplers of channels are checked when they are read.
void check_gltf_animation(nlohmann::json& animation, std::size_t index, std::size_t accessors, std::size_t nodes,
                          const std::string& file);

}  // namespace halflight
