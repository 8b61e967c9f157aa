// Names of layers in .exr files as other renderers give them.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace halflight {

enum class AovNames : std::uint8_t { halflight, blender, arnold };
/// Returns the names that a word stands for: "halflight", "blender" or "arnold".
std::optional<AovNames> aov_names_named(std::string_view word);

/// Returns the channels of a layer under other names. layer: "rgba" for the picture, else its name in the table of
/// layers. Layers without a counterpart, and mattes, keep their names.
std::vector<std::string> renamed(AovNames names, std::string_view layer, const std::vector<std::string>& channels);

}  // namespace halflight
