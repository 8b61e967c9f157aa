// The schema of glTF's JSON: properties, their types, and the targets of their indices.
#pragma once

#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "engine/core/error.h"

namespace halflight {

class GltfWarnings;

/// Fault of an object of a list, which may be used by nothing.
struct GltfFault {
    std::string list;
    std::size_t index = 0;
    Error error;
};

/// Returns the element in the subject of an error about `file`: "nodes[3].mesh".
std::string element_of(const Error& error, const std::string& file);

/// Parses JSON. Throws Error that names `file` for invalid JSON, for too deep nesting, and if the memory budget has
/// too little left for its values.
nlohmann::json parse_gltf_json(std::string_view text, const std::string& file);

/// Checks all properties that the loader reads for the rest pose. Later code then finds values of the right type,
/// arrays of the right length and indices in range. Removes all other properties. Whole numbers written as 3.0 become
/// integers, and numbers in real properties become floating point. Optional members that are null, and damaged material
/// variants, are removed with a warning. Objects of lists that have faults are replaced (gltf_stubs()), and their
/// faults returned. Throws Error that names `file` and the property for all other faults.
std::vector<GltfFault> check_gltf(nlohmann::json& root, const std::string& file, GltfWarnings& warnings);

/// Checks animations[index], which check_gltf() ignores: a damaged animation must prevent neither the rest pose nor the
/// other animations. The samplers of channels are checked when they are read.
void check_gltf_animation(nlohmann::json& animation, std::size_t index, std::size_t accessors, std::size_t nodes,
                          const std::string& file, GltfWarnings& warnings);

}  // namespace halflight
