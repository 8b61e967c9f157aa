// EXT_lights_area, a draft: rectangles and discs that shine to one side. They become emissive meshes.
#pragma once

#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "engine/io/gltf/document.h"

namespace halflight {

/// A node that shows the mesh of an area light, the node that refers to the light, and the size in units of that node.
struct AreaLightNode {
    std::size_t child = 0, node = 0;
    double width = 0, height = 0;
};

/// Adds a mesh and a material for each area light that the scene uses, and to each node that refers to one a child that
/// shows the mesh. The mesh is a square of side 1, or a disc of 64 sides and the area of its circle. Behind it lies a
/// black body, as thick as a thousandth of its size, with a rim as wide. Other lights of these nodes are removed, with
/// a warning. `root` has passed check_gltf(). Throws Error for lengths that are not positive or too large, and for
/// types that are unknown.
std::vector<AreaLightNode> add_area_lights(nlohmann::json& root, GltfDocument& document);

/// Gives the children their transforms, by which the lights have their size times the largest component of the world
/// scale of their nodes at rest, whatever the other components. A node without volume gives its own transform.
void size_area_lights(const std::vector<AreaLightNode>& lights, GltfDocument& document);

}  // namespace halflight
