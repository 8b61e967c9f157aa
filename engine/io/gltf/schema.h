// The shape of glTF's JSON: which properties there are, of which types, and what their indices point into.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace halflight {

/// Throws Error that names `file` for what is no JSON, or nested too deep.
nlohmann::json parse_gltf_json(std::string_view text, const std::string& file);

/// Checks all that the loader reads of a scene at rest, so that later code meets only values of the right type, arrays
/// of the right length and indices in range. `extras` are removed. Whole numbers written as 3.0 become integers,
/// numbers in places for real ones become floating point. Throws Error that names `file` and the property.
void check_gltf(nlohmann::json& root, const std::string& file);

/// The same check of the list `animations`, which check_gltf() does not look at: a damaged one is no reason to
/// refuse a scene that is shown at rest. Samplers of channels are checked by whoever reads them.
void check_gltf_animations(nlohmann::json& animations, std::size_t accessors, std::size_t nodes,
                           const std::string& file);

}  // namespace halflight
