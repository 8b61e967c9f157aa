// Tests that every row of the table of material properties is read from glTF, validated, packed and animated. Also
// tests the texts made from the table. HALFLIGHT_REWRITE=1 rewrites these texts.
#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <map>
#include <set>

#include "engine/io/files.h"
#include "engine/scene/material_properties.h"
#include "engine/tables/shading_tables.h"
#include "shaders/shared/texture_rows.h"
#include "shaders/shared/word.h"
#include "tests/unit/io/gltf_builder.h"
#include "tests/unit/renderer/refusal.h"

namespace halflight {
namespace {

constexpr const char* kWhiteTexel =
    "data:image/png;base64,"
    "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAIAAACQd1PeAAAADElEQVR4nGP4//8/AAX+Av4N70a4AAAAAElFTkSuQmCC";

bool is_flag(const MaterialProperty& p) {
    return std::holds_alternative<bool Material::*>(p.field);
}

/// Returns a value in the range that is not the default and differs from component to component.
vec4 other_value(const MaterialProperty& p) {
    vec4 value(0);
    if (is_flag(p)) return vec4(1, 0, 0, 0);
    for (int i = 0; i < component_count(p.field); ++i)
        value[i] = (p.range.lowest == 1 ? 2.0f : 0.0f) + 0.125f * static_cast<float>(i + 1);
    return value;
}

Json json_of(const MaterialProperty& p, const vec4& value) {
    if (is_flag(p)) return std::string_view(p.path).starts_with("/extensions") ? Json::object() : Json(true);
    if (component_count(p.field) == 1) return value.x;
    Json array = Json::array();
    for (int i = 0; i < component_count(p.field); ++i) array.push_back(value[i]);
    return array;
}

/// Returns a textured triangle with tangents and a material in which every lobe and every texture contributes.
Scene scene_of_everything() {
    Scene scene;
    scene.name = "everything";
    scene.images.push_back({"white", 1, 1, {255, 255, 255, 255}});
    Material& m = scene.materials.emplace_back();
    for (const MaterialProperty& p : material_properties())
        if (p.scales_lobe) set_value(m, p.field, vec4(0.5f));
    m.attenuation_distance = 0.5f;
    for (const MaterialTexture& texture : material_textures()) (m.*texture.field).image = 0;
    Mesh& mesh = scene.meshes.emplace_back();
    mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    mesh.normals.assign(3, vec3(0, 0, 1));
    mesh.tangents.assign(3, vec4(1, 0, 0, 1));
    mesh.triangles = {{0, 1, 2}};
    mesh.triangle_material = {0};
    scene.instances.emplace_back().mesh = 0;
    return scene;
}

ShadingTables tables_of(const Scene& scene) {
    return build_shading_tables(scene, build_trace_tables(scene));
}

class MaterialTable : public GltfTest {
  protected:
    void SetUp() override {
        GltfTest::SetUp();
        Json& primitive = b.add_triangle();
        primitive["material"] = b.push("materials", Json::object());
        primitive["attributes"]["TEXCOORD_0"] = b.floats("VEC2", {0, 1, 1, 1, 0, 0});
        b.push("textures", {{"source", b.push("images", {{"uri", kWhiteTexel}})}});
    }
    /// Adds the textures that a property belongs to; for example, a scale is part of a textureInfo.
    void make_textures_of(const MaterialProperty& p) {
        for (const MaterialTexture& t : material_textures())
            if (std::string_view(p.path).starts_with(std::string(t.path) + "/")) at(t.path) = {{"index", 0}};
    }
    Json& at(const std::string& path) { return b.json["materials"][0][Json::json_pointer(path)]; }
    /// Returns a material that a pointer animates, halfway from `from` to `to`.
    Material driven(const std::string& path, std::vector<float> from, const std::vector<float>& to) {
        static const char* const kTypes[] = {"SCALAR", "VEC2", "VEC3", "VEC4"};
        const char* type = kTypes[to.size() - 1];
        from.insert(from.end(), to.begin(), to.end());
        const int input = b.floats("SCALAR", {0, 1}), output = b.floats(type, from);
        const Json extension = {{"KHR_animation_pointer", {{"pointer", "/materials/0" + path}}}};
        b.json["animations"] = {
            {{"samplers", {{{"input", input}, {"output", output}}}},
             {"channels", {{{"sampler", 0}, {"target", {{"path", "pointer"}, {"extensions", extension}}}}}}}};
        GltfScene scene(write("scene.glb", b.glb()));
        EXPECT_EQ(scene.animation_warnings(), std::vector<std::string>{}) << path;
        return scene.at(0.5, kFirst).materials.at(0);
    }

    GltfBuilder b;
};

TEST_F(MaterialTable, CoversEveryMemberAndEveryNeed) {
    Material m;
    std::vector<bool> covered(sizeof m, false);
    const auto cover = [&](const auto& member) {
        const auto first = reinterpret_cast<const char*>(&member) - reinterpret_cast<const char*>(&m);
        std::fill_n(covered.begin() + first, sizeof member, true);
    };
    cover(m.name), cover(m.alpha_mode), cover(m.light_group), cover(m.links);
    for (const MaterialProperty& p : material_properties()) std::visit([&](auto member) { cover(m.*member); }, p.field);
    for (const MaterialTexture& t : material_textures()) cover(m.*t.field);
    std::size_t gap = 0;
    const auto links = std::size_t(reinterpret_cast<const char*>(&m.links) - reinterpret_cast<const char*>(&m));
    for (std::size_t i = 0; i < sizeof m; ++i) {
        gap = covered[i] ? 0 : gap + 1;
        // Padding stands before the links and at the end.
        EXPECT_LT(gap, i + 1 == links || i + 1 == sizeof m ? alignof(Material) : alignof(float))
            << "the member at byte " << i + 1 - gap << " has no row";
    }
    MaterialNeeds needs;
    std::set<const bool*> flags;
    for (const MaterialLobe& lobe : material_lobes()) EXPECT_TRUE(flags.insert(&(needs.*lobe.need)).second);
    for (const MaterialTexture& t : material_textures()) EXPECT_TRUE(flags.insert(&(needs.*t.need)).second) << t.name;
    EXPECT_EQ(flags.size(), sizeof needs);
}

TEST_F(MaterialTable, PropertiesAreReadFromGltf) {
    for (const MaterialProperty& p : material_properties()) {
        if (!*p.path) continue;
        SCOPED_TRACE(p.name);
        b.json["materials"][0] = Json::object();
        make_textures_of(p);
        EXPECT_EQ(value_of(load(b).materials.at(0), p.field), value_of(Material{}, p.field));
        at(p.path) = json_of(p, other_value(p));
        const Scene scene = load(b);
        EXPECT_EQ(value_of(scene.materials.at(0), p.field), other_value(p));
        EXPECT_TRUE(scene.report.warnings.empty());
        at(p.path) = "text";
        EXPECT_TRUE(refusal(b).starts_with("materials[0].")) << refusal(b);
    }
}

TEST_F(MaterialTable, TexturesAreReadFromGltf) {
    for (const MaterialTexture& t : material_textures()) {
        SCOPED_TRACE(t.name);
        b.json["materials"][0] = Json::object();
        EXPECT_FALSE(load(b).materials.at(0).*t.field);
        at(t.path) = {{"index", 0}};
        const Material m = load(b).materials.at(0);
        for (const MaterialTexture& other : material_textures())
            EXPECT_EQ(bool(m.*other.field), other.name == t.name) << other.name;
        at(t.path) = {{"index", 7}};
        EXPECT_NE(refusal(b).find(".index: 7 is not an index into textures"), std::string::npos) << refusal(b);
    }
}

TEST_F(MaterialTable, RangesAreValidatedAndClamped) {
    for (const MaterialProperty& p : material_properties()) {
        if (is_flag(p)) continue;
        SCOPED_TRACE(p.name);
        const auto message = [&](float value) {
            Scene scene = scene_of_everything();
            vec4 values = value_of(scene.materials[0], p.field);
            values[component_count(p.field) - 1] = value;
            set_value(scene.materials[0], p.field, values);
            return error_message([&] { validate(scene); });
        };
        const std::string element = fmt::format("materials[0].{}: ", p.name);
        EXPECT_EQ(message(other_value(p).x), "");
        EXPECT_TRUE(message(std::nanf("")).starts_with(element));
        EXPECT_TRUE(message(std::numeric_limits<float>::infinity()).starts_with(element));
        for (const float outside : {p.range.lowest - 0.5f, p.range.highest + 0.5f}) {
            if (std::isinf(outside)) continue;
            EXPECT_TRUE(message(outside).starts_with(element));
            b.json["materials"][0] = Json::object();
            make_textures_of(p);
            at(p.path) = json_of(p, vec4(outside));
            const Scene scene = load(b);
            ASSERT_FALSE(scene.report.warnings.empty());
            EXPECT_NE(scene.report.warnings[0].find("materials[0]: "), std::string::npos);
            EXPECT_EQ(value_of(scene.materials[0], p.field).x,
                      outside < p.range.lowest ? p.range.lowest : p.range.highest);
        }
    }
}

TEST_F(MaterialTable, PropertiesArePacked) {
    const Scene scene = scene_of_everything();
    const auto rows_of = [](const Scene& s) { return tables_of(s).materials; };
    std::set<std::pair<int, int>> components;
    for (const MaterialProperty& p : material_properties()) {
        SCOPED_TRACE(p.name);
        Scene changed = scene;
        changed.materials[0].alpha_mode = AlphaMode::mask;
        set_value(changed.materials[0], p.field, other_value(p));
        const std::vector<vec4> rows = rows_of(changed);
        ASSERT_EQ(rows.size(), static_cast<std::size_t>(material_rows()));
        for (int i = 0; p.packing.row != kNone && i < component_count(p.field); ++i) {
            EXPECT_TRUE(components.emplace(p.packing.row, p.packing.component + i).second) << "is used twice";
            EXPECT_EQ(rows[p.packing.row][p.packing.component + i], packed_value(changed.materials[0], p)[i]);
            EXPECT_NE(packed_value(changed.materials[0], p), packed_value(scene.materials[0], p));
        }
        changed.materials[0].unlit = true;
        if (p.scales_lobe) {
            EXPECT_EQ(rows_of(changed)[p.packing.row][p.packing.component], 0);
        }
    }
    const ShadingTables tables = tables_of(scene);
    for (const MaterialLobe& lobe : material_lobes())
        EXPECT_EQ(tables.needs.*lobe.need, lobe.need != &MaterialNeeds::unlit) << lobe.label;
    for (const MaterialTexture& t : material_textures()) {
        SCOPED_TRACE(t.name);
        EXPECT_TRUE(components.emplace(t.packing.row, t.packing.component).second) << "is used twice";
        EXPECT_TRUE(tables.needs.*t.need);
        const auto slot = [&](const ShadingTables& of) {
            return shared::word_of_float(of.materials[t.packing.row][t.packing.component]);
        };
        EXPECT_LT(slot(tables), tables.textures.size() / shared::kTextureStride);
        Scene without = scene;
        without.materials[0].*t.field = {};
        const ShadingTables less = tables_of(without);
        EXPECT_EQ(slot(less), shared::kNoTexture);
        EXPECT_FALSE(less.needs.*t.need);
    }
}

TEST_F(MaterialTable, NumbersAreAnimated) {
    for (const MaterialProperty& p : material_properties()) {
        if (is_flag(p)) continue;
        SCOPED_TRACE(p.name);
        b.json["materials"][0] = Json::object();
        std::vector<float> from, to;
        for (int i = 0; i < component_count(p.field); ++i) {
            from.push_back(other_value(p)[i]);
            to.push_back(from.back() + 0.25f);
        }
        EXPECT_EQ(value_of(driven(p.path, from, to), p.field)[component_count(p.field) - 1], from.back() + 0.125f);
    }
}

TEST_F(MaterialTable, TextureTransformsAreAnimated) {
    for (const MaterialTexture& t : material_textures()) {
        SCOPED_TRACE(t.name);
        b.json["materials"][0] = Json::object();
        const std::string transform = std::string(t.path) + "/extensions/KHR_texture_transform";
        EXPECT_FALSE(driven(transform + "/offset", {0, 0}, {1, 0.5f}).*t.field) << "an offset makes no texture";
        at(t.path) = {{"index", 0}};
        EXPECT_EQ((driven(transform + "/offset", {0, 0}, {1, 0.5f}).*t.field).uv_transform[2], vec2(0.5f, 0.25f));
        EXPECT_EQ((driven(transform + "/scale", {1, 1}, {3, 2}).*t.field).uv_transform[0].x, 2);
        EXPECT_EQ((driven(transform + "/rotation", {0}, {2}).*t.field).uv_transform[0].x, std::cos(1.0f));
    }
}

TEST(MaterialProperties, AreSetByName) {
    Material m;
    const auto set = [&](std::string_view name, std::vector<float> values) {
        set_property(m, name, values, "materials[0]");
    };
    set("roughness", {0.25f}), set("emission", {1, 2, 3}), set("double_sided", {1});
    const std::tuple<const char*, std::vector<float>, const char*> refusals[] = {
        {"shine", {1}, "no property 'shine'"},
        {"roughness", {1, 2}, "roughness takes 1 numbers"},
        {"roughness", {2}, "roughness: 2"},
        {"ior", {0.5f}, "ior: 0.5"}};
    for (const auto& [name, values, element] : refusals)
        expect_refusal([&] { set(name, values); }, element, "materials[0]: ");
    EXPECT_EQ(m.roughness, 0.25f);
    EXPECT_EQ(m.emission, vec3(1, 2, 3));
    EXPECT_TRUE(m.double_sided);
}

// --- Texts made from the table -------------------------------------------------------------------------------------

constexpr const char* kHead =
    R"(// tests/unit/scene/test_material_properties.cpp writes this file from the table of engine/scene/material_properties.h.
// After a change of the table, this command writes it anew: HALFLIGHT_REWRITE=1 ctest --preset release -R material_properties
//
// Unpacks the rows of materials (kUnitMaterials, RGBA32F), kMaterialStride texels for each of Scene::materials. A slot is
// a word (word.h): the index of a descriptor (texture_rows.h), or kNoTexture. Needs shaders/scene_tables.glsl.
//
)";

constexpr const char* kFunctions = R"(
// Properties that no material of the scene needs are constants, which the compiler folds.
struct Material {{
{members}    vec3 normal;           // n: normal-mapped, on the side of n_g, bent towards wo
    vec3 coat_normal;      // n_k
    bool front;            // true: wo is outside, on the side of the vertex normals
    int channel;           // colour channel of the path, 0 to 2, for solids that disperse light
    bool bent;             // true: wo is behind n as it was before bending, or behind the coat's n_k
    vec3 rough_direction;  // direction of the higher roughness, perpendicular to n; 0: none
}};

// Returns the factors; the caller sets the normals and the direction.
Material load_material(uint material) {{
    Material m;
{loads}    return m;
}}

// Multiplies the factors by their textures, except for those that need tangents.
void multiply_textures(inout Material m, uint material, vec2 uv0, vec2 uv1) {{
{multiplies}}}
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

/// Returns the assignment of a property to its member of `m`, or of its default if its macro is 0.
std::string load(const MaterialProperty& p) {
    const int count = component_count(p.field);
    const std::string value = fmt::format("packed_{}(material){}", p.name,
                                          is_flag(p)   ? " != 0.0"
                                          : count == 4 ? ".rgb"
                                                       : "");
    if (!p.need) return fmt::format("    m.{} = {};\n", p.shader, value);
    const vec4 constant = packed_value(Material{}, p);
    const std::string otherwise = is_flag(p) ? constant.x != 0 ? "true" : "false"
                                  : count == 1
                                      ? fmt::format("{:.1f}", constant.x)
                                      : fmt::format("vec3({:.1f}, {:.1f}, {:.1f})", constant.x, constant.y, constant.z);
    return fmt::format("    m.{} = HALFLIGHT_{} != 0 ? {} : {};\n", p.shader, define_of(p.need), value, otherwise);
}

std::string range_of(const MaterialProperty& p) {
    if (is_flag(p)) return "false or true";
    const bool below = std::isinf(p.range.lowest), above = std::isinf(p.range.highest);
    if (below && above) return "finite";
    return above ? fmt::format(">= {}", p.range.lowest) : fmt::format("{} to {}", p.range.lowest, p.range.highest);
}

std::string type_of(const MaterialProperty& p) {
    return is_flag(p) ? "flag" : glsl_type(component_count(p.field));
}

std::string default_of(const MaterialProperty& p) {
    const vec4 value = value_of(Material{}, p.field);
    if (is_flag(p)) return value.x != 0 ? "true" : "false";
    std::string text = fmt::format("{}", value.x);
    for (int i = 1; i < component_count(p.field); ++i) text += fmt::format(", {}", value[i]);
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

/// Returns shaders/lib/material_properties.glsl: the rows, and how they are unpacked into GLSL's struct Material.
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
        members += fmt::format("    {} {};\n", is_flag(p) ? "bool" : glsl_type(std::min(count, 3)), p.shader);
        loads += load(p);
    }
    text += '\n';
    for (const MaterialTexture& t : material_textures()) {
        text += fmt::format("uint {}_slot(uint material) {{ return word_of_float(material_row(material, {}).{}); }}\n",
                            t.name, t.packing.row, swizzle(t.packing, 1));
        if (t.multiplies.empty()) continue;
        multiplies += fmt::format(
            "    if (HALFLIGHT_{} != 0) {{\n        vec4 texel = {}_texture({}_slot(material), uv0, uv1);\n", t.define,
            t.use == TextureUse::color ? "color" : "data", t.name);
        for (const TexturedProperty& factor : t.multiplies)
            multiplies += fmt::format("        m.{} *= texel.{};\n", factor.shader, factor.channels);
        multiplies += "    }\n";
    }
    return text + fmt::format(kFunctions, fmt::arg("members", members), fmt::arg("loads", loads),
                              fmt::arg("multiplies", multiplies));
}

/// Returns the tables of docs/materials.md: properties, textures and lobes.
std::string material_tables() {
    std::string text =
        "| Property | glTF: pointer in the material | Type | Range | Default | Texture, channels | GPU row | Meaning "
        "|\n"
        "| --- | --- | --- | --- | --- | --- | --- | --- |\n";
    for (const MaterialProperty& p : material_properties()) {
        const std::string path = *p.path ? fmt::format("`{}`", p.path) : "";
        text += fmt::format("| `{}` | {} | {} | {} | {} | {} | {} | {} |\n", p.name, path, type_of(p), range_of(p),
                            default_of(p), texture_of(p), place_of(p.packing, component_count(p.field)), p.meaning);
    }
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

/// Compares the file's text between `begin` and `end` (empty: all of it) with `text`, or replaces it by `text`.
void expect_text(const std::string& name, const std::string& begin, const std::string& end, const std::string& text) {
    const std::filesystem::path path = std::filesystem::path(HALFLIGHT_SOURCE_DIR) / name;
    std::string file = std::filesystem::exists(path) ? read_file(path, 1 << 20) : "";
    const std::size_t first = begin.empty() ? 0 : file.find(begin) + begin.size();
    const std::size_t last = end.empty() ? file.size() : file.find(end, first);
    ASSERT_LE(first, file.size()) << name << " has no line " << begin;
    ASSERT_LE(last, file.size()) << name << " has no line " << end;
    if (std::getenv("HALFLIGHT_REWRITE"))
        std::ofstream(path, std::ios::binary) << file.replace(first, last - first, text);
    else
        EXPECT_EQ(file.substr(first, last - first), text)
            << name << " is out of date: run this program with HALFLIGHT_REWRITE=1";
}

TEST(MaterialTexts, TheShaderUnpacksTheTable) {
    expect_text("shaders/lib/material_properties.glsl", "", "", material_glsl());
}

TEST(MaterialTexts, TheDocumentShowsTheTable) {
    expect_text("docs/materials.md", "<!-- table: tests/unit/scene/test_material_properties.cpp -->\n",
                "<!-- end -->\n", "\n" + material_tables() + "\n");
}

}  // namespace
}  // namespace halflight
