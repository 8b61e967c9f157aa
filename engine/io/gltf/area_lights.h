// EXT_lights_area, a draft: rectangles and discs that shine to one side. They become emissive meshes.
#pragma once

#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "engine/io/gltf/document.h"

namespace halflight {

/// Adds a mesh and a material for each area light that nodes refer to, and to each of these nodes a child that shows
/// the mesh. A disc has 64 sides and the area of its circle. `root` has passed check_gltf(). Returns the children, as
/// indices into the list of nodes. Throws Error for a value that is not positive or a type that is unknown.
std::vector<std::size_t> add_area_lights(nlohmann::json& root, GltfDocument& document);

/// Scales the children so that, at rest, the largest component of the world scale of their parents applies to all axes,
/// as the draft demands.
void scale_area_lights(const std::vector<std::size_t>& children, GltfDocument& document);

}  // namespace halflight
