#include "tests/unit/scene/material_texts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "engine/scene/material_properties.h"

namespace halflight {
namespace {

constexpr const char* kHead =
    R"(// tests/unit/scene/test_material_properties.cpp writes this file from the table of engine/scene/material_properties.h.
// After a change of the table, this command writes it anew: HALFLIGHT_REWRITE=1 build/tests/test_material_properties
//
// Unpacks the rows of materials (UNIT_MATERIALS, RGBA32F), kMaterialStride texels for each of Scene::materials. A slot is
// a word (word.h): the index of a descriptor (texture.h), or kNoTexture. Needs shaders/scene_tables.glsl.
//
)";

constexpr const char* kStruct = R"(
// Properties that no material of the scene needs are constants, which the compiler folds.
struct Material {
{members}    vec3 normal;           // n: normal-mapped, on the side of n_g, bent towards wo
    vec3 coat_normal;      // n_k
    bool front;            // true: wo is outside, on the side of the vertex normals
    int channel;           // colour channel of the path, 0 to 2, for solids that disperse light
    bool bent;             // true: wo is behind n as it was before bending, or behind the coat's n_k
    vec3 rough_direction;  // direction of the higher roughness, perpendicular to n; 0: none
};
)";

const char* swizzle(const MaterialPacking& packing, int count) {
    static const char* const kSwizzles[] = {"x", "y", "z", "w", "rgb", "rgba"};
    return kSwizzles[count == 1 ? packing.component : count == 3 ? 4 : 5];
}

std::string glsl_type(int count) {
    return count == 1 ? "float" : fmt::format("vec{}", count);
}

/// Returns the macro of a lobe or texture without the prefix HALFLIGHT_.
std::string define_of(bool MaterialNeeds::*need) {
    for (const MaterialLobe& lobe : material_lobes())
        if (lobe.need == need) return lobe.define;
    for (const MaterialTexture& texture : material_textures())
        if (texture.need == need) return texture.define;
    return "";
}

/// Describes the contents of the rows, one line per row.
std::string row_list() {
    std::map<std::pair<int, int>, std::string> parts;
    for (const MaterialProperty& p : material_properties()) {
        if (p.packing.row == kNone) continue;
        const int count = component_count(p.field);
        parts[{p.packing.row, p.packing.component}] =
            count == 1 ? p.name : fmt::format("{}.{}", p.name, swizzle(p.packing, count));
    }
    for (const MaterialTexture& t : material_textures())
        parts[{t.packing.row, t.packing.component}] = fmt::format("slot of {}", t.name);
    std::string lines;
    for (int row = 0; row < material_rows(); ++row) {
        std::string line;
        for (const auto& [place, part] : parts)
            if (place.first == row) line += (line.empty() ? "" : ", ") + part;
        lines += fmt::format("//   row {}  {}\n", row, line);
    }
    return lines;
}

/// Returns the assignment of a property to its member of `m`, or of its default if its macro is not defined.
std::string load(const MaterialProperty& p) {
    const bool flag = std::holds_alternative<bool Material::*>(p.field);
    const int count = component_count(p.field);
    const std::string value = fmt::format("packed_{}(material){}", p.name, flag ? " != 0.0" : count == 4 ? ".rgb" : "");
    const std::string line = fmt::format("    m.{} = {};\n", p.shader, value);
    if (!p.need) return line;
    const vec4 constant = packed_value(Material{}, p);
    const std::string otherwise = flag ? constant.x != 0 ? "true" : "false"
                                  : count == 1
                                      ? fmt::format("{:.1f}", constant.x)
                                      : fmt::format("vec3({:.1f}, {:.1f}, {:.1f})", constant.x, constant.y, constant.z);
    return fmt::format("#ifdef HALFLIGHT_{}\n{}#else\n    m.{} = {};\n#endif\n", define_of(p.need), line, p.shader,
                       otherwise);
}

std::string number(float value) {
    return fmt::format("{}", value);
}

std::string range_of(const MaterialProperty& p) {
    if (std::holds_alternative<bool Material::*>(p.field)) return "false or true";
    const bool below = std::isinf(p.range.lowest), above = std::isinf(p.range.highest);
    if (below && above) return "finite";
    return above ? ">= " + number(p.range.lowest)
                 : fmt::format("{} to {}", number(p.range.lowest), number(p.range.highest));
}

std::string type_of(const MaterialProperty& p) {
    return std::holds_alternative<bool Material::*>(p.field) ? "flag" : glsl_type(component_count(p.field));
}

std::string default_of(const MaterialProperty& p) {
    const vec4 value = value_of(Material{}, p.field);
    if (std::holds_alternative<bool Material::*>(p.field)) return value.x != 0 ? "true" : "false";
    std::string text = number(value.x);
    for (int i = 1; i < component_count(p.field); ++i) text += ", " + number(value[i]);
    return text;
}

/// Returns the row and components of a packing, for example "2.w".
std::string place_of(const MaterialPacking& packing, int count) {
    return packing.row == kNone ? "" : fmt::format("{}.{}", packing.row, swizzle(packing, count));
}

std::string texture_of(const MaterialProperty& p) {
    for (const MaterialTexture& texture : material_textures())
        for (const TexturedProperty& factor : texture.multiplies)
            if (*p.shader && std::string_view(factor.shader) == p.shader)
                return fmt::format("`{}`, {}", texture.name, factor.channels);
    return "";
}

}  // namespace

std::string material_glsl() {
    std::string text = kHead + row_list();
    text += "#include \"shaders/lib/texture.glsl\"\n#include \"shaders/shared/word.h\"\n\n";
    text += fmt::format("const int kMaterialStride = {};\n\n", material_rows());
    text +=
        "vec4 material_row(uint material, int row) {\n"
        "    return texelFetch(scene_materials, int(material) * kMaterialStride + row);\n}\n\n";
    std::string members, loads, multiplies;
    for (const MaterialProperty& p : material_properties()) {
        if (p.packing.row == kNone) continue;
        const int count = component_count(p.field);
        text += fmt::format("{} packed_{}(uint material) {{ return material_row(material, {}).{}; }}\n",
                            glsl_type(count), p.name, p.packing.row, swizzle(p.packing, count));
        if (!*p.shader) continue;
        const bool flag = std::holds_alternative<bool Material::*>(p.field);
        members += fmt::format("    {} {};\n", flag ? "bool" : glsl_type(std::min(count, 3)), p.shader);
        loads += load(p);
    }
    text += '\n';
    for (const MaterialTexture& t : material_textures()) {
        text += fmt::format("uint {}_slot(uint material) {{ return word_of_float(material_row(material, {}).{}); }}\n",
                            t.name, t.packing.row, swizzle(t.packing, 1));
        if (t.multiplies.empty()) continue;
        multiplies += fmt::format("#ifdef HALFLIGHT_{}\n    vec4 {} = {}_texture({}_slot(material), uv0, uv1);\n",
                                  t.define, t.name, t.use == TextureUse::color ? "color" : "data", t.name);
        for (const TexturedProperty& factor : t.multiplies)
            multiplies += fmt::format("    m.{} *= {}.{};\n", factor.shader, t.name, factor.channels);
        multiplies += "#endif\n";
    }
    std::string members_in = kStruct;
    members_in.replace(members_in.find("{members}"), 9, members);
    text += members_in;
    text +=
        "\n// Returns the factors; the caller sets the normals and the direction.\nMaterial load_material(uint "
        "material) {\n";
    text += "    Material m;\n" + loads + "    return m;\n}\n\n";
    text +=
        "// Multiplies the factors by their textures, except for those that need tangents.\n"
        "void multiply_textures(inout Material m, uint material, vec2 uv0, vec2 uv1) {\n" +
        multiplies + "}\n";
    return text;
}

std::string material_tables() {
    std::string text =
        "| Property | glTF: pointer in the material | Type | Range | Default | Texture, channels | GPU row | Meaning "
        "|\n"
        "| --- | --- | --- | --- | --- | --- | --- | --- |\n";
    for (const MaterialProperty& p : material_properties())
        text += fmt::format("| `{}` | `{}` | {} | {} | {} | {} | {} | {} |\n", p.name, p.path, type_of(p), range_of(p),
                            default_of(p), texture_of(p), place_of(p.packing, component_count(p.field)), p.meaning);
    text +=
        "\n| Texture | glTF: pointer in the material | Encoding | GPU row of the slot | Looked up where "
        "`HALFLIGHT_...` is "
        "defined |\n| --- | --- | --- | --- | --- |\n";
    static const char* const kUses[] = {"sRGB", "linear", "normal map", "linear direction and strength"};
    for (const MaterialTexture& t : material_textures())
        text += fmt::format("| `{}` | `{}` | {} | {} | `{}` |\n", t.name, t.path, kUses[static_cast<int>(t.use)],
                            place_of(t.packing, 1), t.define);
    text +=
        "\n| Lobe or feature | Compiled in where `HALFLIGHT_...` is defined | Left out where |\n| --- | --- | --- |\n";
    for (const MaterialLobe& l : material_lobes())
        text += fmt::format("| {} | `{}` | {} |\n", l.label, l.define, l.fact);
    return text;
}

}  // namespace halflight
