// The shape of glTF's JSON: which properties there are, of which types, and what their indices point into.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace halflight {

/// Parses and checks all that the loader reads, so that later code meets only values of the right type, arrays of the
/// right length and indices in range. `extras` are left out. Whole numbers written as 3.0 become integers, numbers in
/// places for real ones become floating point. Throws Error that names `file` and the property.
nlohmann::json parse_gltf_json(std::string_view text, const std::string& file);

}  // namespace halflight
