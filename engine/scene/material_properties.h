// The table of material properties: one row per property, texture and lobe. It drives glTF reading, schema and
// animation pointers (engine/io/gltf), validation, edits by name, the packing for the GPU (engine/tables), the
// unpacking in shaders/lib/material_properties.glsl and the tables of docs/materials.md. The last two are text that
// tests/unit/scene/test_material_properties.cpp compares with this table, and rewrites on request.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "engine/scene/animation.h"
#include "engine/scene/material.h"
#include "engine/scene/property_range.h"

namespace halflight {

/// The member of Material that holds a property.
using MaterialField = std::variant<float Material::*, vec3 Material::*, vec4 Material::*, bool Material::*>;

/// A component of a material's rows in kUnitMaterials (RGBA32F).
struct MaterialPacking {
    int row = kNone;    // row of the material; kNone: not packed
    int component = 0;  // first component of the property, 0 to 3
};

/// A property whose default is its member's value in Material{}.
struct MaterialProperty {
    const char* name;     // the member of Material; names the property in edits and messages
    MaterialField field;  //
    const char* path;     // JSON pointer within a glTF material; an extension alone: true if it is present; "": none
    PropertyRange range = {};
    MaterialPacking packing = {};
    const char* shader = "";              // the member of GLSL's struct Material; "": none
    bool MaterialNeeds::*need = nullptr;  // shaders read the property only if this holds; null: always
    bool scales_lobe = false;             // true: packed as 0 for unlit materials
    AnimatedProperty animated = AnimatedProperty::surface;  // target of animations of the property
    vec4 (*packed)(const Material&) = nullptr;              // returns the packed value; null: the member itself
    const char* meaning = "";                               // description in docs/materials.md
};

enum class TextureUse : std::uint8_t {
    color,       // colour, decoded from sRGB to linear
    data,        // linear data
    normal_map,  // linear normal in tangent space
    direction,   // linear direction in tangent space (rg) with a strength (b)
};

/// Returns whether lookups need tangents, which follow the transform of the texture.
constexpr bool needs_tangents(TextureUse use) {
    return use == TextureUse::normal_map || use == TextureUse::direction;
}

/// A texture channel that multiplies a property.
struct TexturedProperty {
    const char* shader = "";    // member of GLSL's struct Material
    const char* channels = "";  // GLSL swizzle of the texel
};

/// A texture slot.
struct MaterialTexture {
    const char* name;  // the member of Material
    TextureRef Material::*field;
    const char* path;  // JSON pointer of the textureInfo within a glTF material
    TextureUse use;
    std::vector<TexturedProperty> multiplies;  // properties that the texture multiplies; none if it needs tangents
    bool (*matters)(const Material&);          // whether the texture can change the material's appearance
    MaterialPacking packing;                   // place of the slot: a word (shaders/shared/word.h)
    bool MaterialNeeds::*need;
    bool MaterialNeeds::*implies;  // the lobe that the texture belongs to; null: any
    const char* define;            // name of the macro after HALFLIGHT_
    const char* label;             // name of the need
    const char* fact;              // statement that is true if the need is false
};

/// A lobe, or another feature of materials that shaders leave out if no material has it.
struct MaterialLobe {
    const char* label;  // name of the need
    bool MaterialNeeds::*need;
    const char* define;                      // name of the macro after HALFLIGHT_
    const char* fact;                        // statement that is true if the need is false
    bool (*present)(const Material&);        // returns whether a material has the lobe
    bool MaterialNeeds::*implies = nullptr;  // a need that comes with the lobe; its own row is later; null: none
    int record_rows = 0;                     // rows of pack_bsdf() in shaders/lib/bsdf_record.glsl that the lobe adds
    int layer_rows = 0;                      // rows of pack_layers() in shaders/lib/layers.glsl that the lobe adds
    bool tangents = false;                   // the lobe exists only on meshes with tangents
};

std::span<const MaterialProperty> material_properties();
/// Returns the textures. Normal maps stand early: if a material uses more than two sets of texture coordinates, the
/// first two of this order are kept.
std::span<const MaterialTexture> material_textures();
std::span<const MaterialLobe> material_lobes();

/// Returns the number of rows (RGBA32F texels) per material.
int material_rows();
/// Returns the number of rows of a surface record (shaders/shared/surface_rows.h).
int record_rows(const MaterialNeeds& needs);
/// Returns the number of rows that a point for path reuse has for its layers (shaders/shared/reuse_groups.h).
int layer_rows(const MaterialNeeds& needs);

/// Returns the number of components: 1, 3 or 4.
int component_count(const MaterialField& field);
/// Returns the components of a property; flags are 0 or 1, components that it does not have are 0.
vec4 value_of(const Material& material, const MaterialField& field);
void set_value(Material& material, const MaterialField& field, const vec4& value);
/// Returns the components of a property as packed into the rows; components that it does not have are 0.
vec4 packed_value(const Material& material, const MaterialProperty& property);

/// Returns why the value is invalid for the property ("2 is outside [0, 1]"), or an empty text.
std::string range_error(const MaterialProperty& property, const vec4& value);

/// Sets the property `name` ("roughness"). Throws Error about `subject`: no such property, a number of values other
/// than its components, a value outside its range.
void set_property(Material& material, std::string_view name, std::span<const float> values, std::string_view subject);

/// Adds the needs that others imply: a texture needs its lobe, a coat the glossy lobes.
void complete(MaterialNeeds& needs);

}  // namespace halflight
