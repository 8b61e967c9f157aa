// The properties of the selected object: nodes, materials, meshes and cameras.
#include "tools/view/inspector.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "api/halflight/edit_text.h"
#include "engine/scene/black_body.h"
#include "engine/scene/material_properties.h"
#include "tools/view/gizmo.h"
#include "tools/view/outliner.h"
#include "tools/view/widgets.h"

namespace halflight::view {
namespace {

std::set<std::uint32_t> materials_of(const Scene& scene, const std::vector<int>& meshes) {
    std::set<std::uint32_t> materials;
    for (const int mesh : meshes) {
        const auto& of_mesh = scene.meshes[static_cast<std::size_t>(mesh)].triangle_material;
        materials.insert(of_mesh.begin(), of_mesh.end());
    }
    return materials;
}

/// Selects a material, by buttons with the names of those that the selected node or mesh has.
void material_buttons(PanelContext& c, const std::set<std::uint32_t>& materials) {
    if (!materials.empty()) heading("Materials");
    for (const std::uint32_t m : materials) {
        const Selection object{ObjectKind::material, m};
        ImGui::PushID(static_cast<int>(m));
        const std::string& name = c.session.scene().materials[m].name;
        if (button(name.empty() ? c.session.name_of(object).c_str() : name.c_str(), "selects the material", true))
            c.session.selection = object;
        ImGui::PopID();
    }
}

void visibility(PanelContext& c, const Selection& object) {
    if (!can_be_hidden(object, c.session)) return;
    bool shown = !HiddenObjects(c.session).contains(object);
    if (checkbox("Visible", shown, "shows or hides the object, with everything below it"))
        set_shown(c.session, object, shown);
}

void node(PanelContext& c, std::size_t index) {
    SceneEdits& edits = c.session.edits;
    const std::string& name = c.session.references().nodes.at(index);
    visibility(c, {ObjectKind::node, index});
    if (c.session.in_pages()) return text("Scenes in page files cannot move or hide surfaces.");
    const std::vector<int> meshes = c.session.meshes_of_node();
    const std::set<std::uint32_t> materials = materials_of(c.session.scene(), meshes);
    constexpr std::size_t kFew = 8;
    const bool first = materials.size() <= kFew;  // materials are edited more often than places
    if (first) material_buttons(c, materials);
    const auto found = std::ranges::find(edits.nodes, name, &NamedEdit<NodeEdit>::name);
    NodeEdit edit = found == edits.nodes.end() ? NodeEdit() : found->edit;
    const NodeEdit before = edit;
    text("Handles on the picture (G)");
    for (const GizmoMode mode : {GizmoMode::none, GizmoMode::move, GizmoMode::rotate, GizmoMode::scale})
        if (radio(view::name(mode), c.handles == mode, "what the handles on the picture do", mode != GizmoMode::none))
            c.handles = mode;
    bool& on_origin = c.session.pivots_on_origin;
    text("Pivot of rotation and scale");
    if (radio("centre", !on_origin, "the centre of the object's bounds stays where it is")) on_origin = false;
    if (radio("origin", on_origin, "the node's origin stays where it is, as in edits of the command line", true))
        on_origin = true;
    drag("Translate, metres", edit.translate, 0.002f * static_cast<float>(c.session.diagonal()),
         "along the world's axes");
    drag("Rotate, degrees", edit.rotate, 0.5f, "about the world's X, then Y, then Z axis");
    drag("Scale", edit.scale, 0.01f, "factors along the world's axes");
    for (int i = 0; i < 3; ++i)
        if (edit.scale[i] == 0) edit.scale[i] = before.scale[i];
    edit.rotate = glm::clamp(edit.rotate, kEditRotation.lower, kEditRotation.upper);
    edit.scale = glm::clamp(edit.scale, kEditScale.lower, kEditScale.upper);
    const NodeFrame frame = c.session.node_frame(index);
    if (edit.translate == before.translate) keep_pivot(frame, before, edit);
    edit.translate = glm::clamp(edit.translate, kEditPosition.lower, kEditPosition.upper);
    if (edit.matrix) faint_text("A matrix of the edits replaces the node's own transform.");
    if (button("Reset transform", "restores the transform of the scene")) edit = {};
    const dvec3 origin(frame.above * dvec4(frame.origin + edit.translate, 1));
    value("Origin", fmt::format("{:.5g}, {:.5g}, {:.5g}", origin.x, origin.y, origin.z), "world space, metres");
    value("Instances", fmt::format("{}", meshes.size()), "of this node and of those below it");
    if (!first) material_buttons(c, materials);
    if (edit == before) return;
    node_edit(edits, name) = edit;
    remove_empty(edits);
}

/// Shows the hue of a light as the temperature of a black body; returns whether the user has changed it.
bool temperature(vec3& hue) {
    constexpr float kSame = 0.03f;  // largest difference of channels at which a hue counts as that of a black body
    auto kelvin = static_cast<float>(std::round(nearest_black_body(hue, kEditTemperature.lower, double{kMostKelvin})));
    const vec3 difference = glm::abs(black_body_color(double{kelvin}) - hue);
    const bool is_body = std::max({difference.r, difference.g, difference.b}) < kSame;
    if (!slider("Temperature", kelvin, static_cast<float>(kEditTemperature.lower), kMostKelvin,
                is_body ? "%.0f K" : "about %.0f K",
                "sets the hue to that of a black body: 2700 is a warm lamp, 6500 daylight", kClamp))
        return false;
    hue = black_body_color(double{kelvin});
    return true;
}

/// Shows a colour without an upper bound as a hue and a factor. Emission has a unit and a temperature.
bool unbounded_color(const std::string& title, bool emission, vec3& color, const char* help) {
    float strength = std::max({color.r, color.g, color.b});
    vec3 hue = strength > 0 ? color / strength : vec3(1);
    bool other_hue = pick_color(title.c_str(), hue, help);
    if (emission && strength > 0) other_hue |= temperature(hue);
    const bool other_strength =
        slider((title + (emission ? " nits" : " factor")).c_str(), strength, 0, 1e4f, "%.4g", help, kLogarithmic);
    if (other_hue) {  // a dark colour, such as a half-typed one, is a hue, too, and leaves the strength as it is
        const float most = std::max({hue.r, hue.g, hue.b});
        if (most == 0 && !other_strength) return false;
        hue = most > 0 ? hue / most : vec3(1);
    }
    if (!other_hue && !other_strength) return false;
    color = (strength > 0 || other_strength ? strength : 1) * hue;
    return true;
}

/// Shows the control of a property; returns whether it has changed.
bool property(const MaterialProperty& p, vec4& v) {
    std::string title = p.name;
    std::ranges::replace(title, '_', ' ');
    title[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(title[0])));
    if (title == "Ior") title = "IOR";
    const bool fraction = p.range.lowest == 0 && p.range.highest == 1;
    const int count = component_count(p.field);
    if (std::holds_alternative<bool Material::*>(p.field)) {
        bool on = v.x != 0;
        if (!checkbox(title.c_str(), on, p.meaning)) return false;
        v.x = on ? 1.0f : 0.0f;
        return true;
    }
    if (count >= 3 && (fraction || p.range.lowest == 0)) {
        vec3 color(v);
        bool changed = fraction ? pick_color(title.c_str(), color, p.meaning)
                                : unbounded_color(title, p.name == std::string_view("emission"), color, p.meaning);
        if (changed) v = vec4(color, v.a);
        if (count == 4) changed |= slider("Alpha", v.a, 0, 1, "%.3f", "coverage");
        return changed;
    }
    if (count >= 3) {
        dvec3 numbers(v.x, v.y, v.z);
        if (!drag(title.c_str(), numbers, 0.02f, p.meaning)) return false;
        v = vec4(vec3(numbers), v.a);
        return true;
    }
    constexpr float kMost = 1e4f;  // upper end of sliders without a bound
    const float lowest = std::isinf(p.range.lowest) ? -kMost : p.range.lowest;
    const float highest = std::isinf(p.range.highest) ? kMost : std::min(p.range.highest, kMost);
    return slider(title.c_str(), v.x, lowest, highest, "%.4g", p.meaning, fraction ? kClamp : kLogarithmic);
}

/// Shows a property of a material as edits leave it.
void material_property(PanelContext& c, std::size_t index, const MaterialProperty& p, const Material& shown) {
    vec4 v = value_of(shown, p.field);
    ImGui::PushID(p.name);
    const bool changed = property(p, v);
    ImGui::PopID();
    if (!changed || !range_error(p, v).empty()) return;
    MaterialEdit& edit = material_edit(c.session.edits, c.session.references().materials.at(index));
    edit[p.name] = std::vector<float>(&v[0], &v[0] + static_cast<std::size_t>(component_count(p.field)));
    if (p.name == std::string_view("emission")) edit.erase(kEmissionTemperature);
}

void material(PanelContext& c, std::size_t index) {
    static const Material kPlain;
    constexpr std::string_view kUsual[] = {"base_color", "metallic", "roughness", "emission", "ior", "transmission"};
    SceneEdits& edits = c.session.edits;
    const std::string& name = c.session.references().materials.at(index);
    const Material& own = c.session.scene().materials[index];
    const Material shown = c.session.edited_values().materials.at(index);
    const auto usual = [&](const MaterialProperty& p) {
        return std::ranges::find(kUsual, p.name) != std::end(kUsual) ||
               value_of(own, p.field) != value_of(kPlain, p.field);
    };
    if (edits.clay) faint_text("Clay hides the material; the section Light switches it off.");
    for (const MaterialProperty& p : material_properties())
        if (usual(p)) material_property(c, index, p, shown);
    std::vector<const char*> textures;
    for (const MaterialTexture& t : material_textures())
        if (own.*t.field) textures.push_back(t.name);
    if (!textures.empty()) faint_text(fmt::format("Textures multiply the values: {}", fmt::join(textures, ", ")));
    if (button("Reset material", "restores the material of the scene"))
        std::erase_if(edits.materials, [&](const auto& named) { return named.name == name; });
    if (!ImGui::TreeNode("All other properties")) return;
    for (const MaterialProperty& p : material_properties())
        if (!usual(p)) material_property(c, index, p, shown);
    ImGui::TreePop();
}

void mesh(PanelContext& c, std::size_t index) {
    const Mesh& m = c.session.scene().meshes.at(index);
    visibility(c, {ObjectKind::mesh, index});
    value("Triangles", fmt::format("{}", m.triangles.size()));
    value("Vertices", fmt::format("{}", m.positions.size()));
    material_buttons(c, materials_of(c.session.scene(), {static_cast<int>(index)}));
}

void camera(PanelContext& c, std::size_t index) {
    const Camera& camera = c.session.scene().cameras.at(index);
    value("Type", camera.orthographic ? "orthographic" : "perspective");
    if (!camera.orthographic) value("Field of view", fmt::format("{:.2f} deg", glm::degrees(camera.vertical_fov)));
    if (button("Look through", "takes the camera")) c.session.take_camera(index);
}

}  // namespace

void emission_property(PanelContext& c, std::size_t index, const Material& shown) {
    const auto all = material_properties();
    material_property(c, index, *std::ranges::find(all, std::string_view("emission"), &MaterialProperty::name), shown);
}

void inspector(PanelContext& c) {
    const Selection s = c.session.selection;
    if (s.kind == ObjectKind::none) c.outliner.inspected = {};
    if (s.kind == ObjectKind::none)
        return faint_text("A click in the picture or in the list selects an object and shows its properties.");
    std::string title = c.session.name_of(s);
    title[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(title[0])));
    heading(title.c_str());
    // Low windows show the list only. What is under the mouse stays there.
    const bool pointed_at = ImGui::IsWindowHovered() && ImGui::GetMousePos().y >= ImGui::GetCursorScreenPos().y;
    if (std::exchange(c.outliner.inspected, s) != s && !pointed_at) {
        constexpr float kShown = 7;  // lines of properties that are shown at least
        const float least =
            ImGui::GetCursorPosY() + kShown * ImGui::GetFrameHeightWithSpacing() - ImGui::GetWindowHeight();
        if (ImGui::GetScrollY() < least) ImGui::SetScrollY(least);
    }
    ImGui::PushID(static_cast<int>(s.kind));
    ImGui::PushID(static_cast<int>(s.index));
    switch (s.kind) {
        case ObjectKind::none:
            break;
        case ObjectKind::node:
            node(c, s.index);
            break;
        case ObjectKind::mesh:
            mesh(c, s.index);
            break;
        case ObjectKind::light:
            light_properties_of(c, s.index);
            break;
        case ObjectKind::material:
            material(c, s.index);
            break;
        case ObjectKind::camera:
            camera(c, s.index);
            break;
        case ObjectKind::environment:
            environment_properties(c);
            break;
    }
    ImGui::PopID();
    ImGui::PopID();
}

}  // namespace halflight::view
