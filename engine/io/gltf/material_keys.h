// The properties of a glTF material that the loader reads. The schema, animation pointers and the list of supported
// extensions are made from this list.
#pragma once

#include <string>
#include <vector>

#include "engine/scene/animation.h"

namespace halflight {

/// JSON pointer of KHR_materials_pbrSpecularGlossiness within a material.
inline constexpr const char* kSpecularGlossiness = "/extensions/KHR_materials_pbrSpecularGlossiness";

struct GltfMaterialKey {
    enum class Kind { number, numbers, flag, texture, extension };
    std::string path;  // JSON pointer within the material
    Kind kind;
    std::vector<double> default_value;  // number and numbers: one per component
    AnimatedProperty animated;          // target of animations of the property's numbers or texture transform
};

/// Returns the rows of material_properties() and material_textures() (engine/scene/material_properties.h), and the
/// properties that are converted to them: emissiveStrength and KHR_materials_pbrSpecularGlossiness.
const std::vector<GltfMaterialKey>& gltf_material_keys();

}  // namespace halflight
