// Makes texts from the table of material properties (engine/scene/material_properties.h).
#pragma once

#include <string>

namespace halflight {

/// Returns shaders/lib/material_properties.glsl: the rows, and how they are unpacked into GLSL's struct Material.
std::string material_glsl();
/// Returns the tables of docs/materials.md: properties, textures and lobes.
std::string material_tables();

}  // namespace halflight
