// The section "Light": environment, emissive surfaces, lamps, clay.
#include <fmt/format.h>

#include <algorithm>

#include "engine/settings/settings_table.h"
#include "tools/view/inspector.h"
#include "tools/view/widgets.h"

namespace halflight::view {
namespace {

constexpr std::size_t kMostListed =
    100;  // lights, and emissive materials, that are listed; the section Scene lists all

/// Opens the next properties, and scrolls to them, if they belong to an object that has just been selected.
void open_if(PanelContext& c, bool selected) {
    if (!selected || c.outliner.lit == c.session.selection) return;
    ImGui::SetNextItemOpen(true);
    ImGui::SetScrollHereY(0);
}

/// Returns whether a material is selected, or is one of the selected node or mesh.
bool is_selected(const Session& session, std::size_t material) {
    const Selection& s = session.selection;
    if (s.kind == ObjectKind::material) return s.index == material;
    std::vector<int> meshes = session.meshes_of_node();
    if (s.kind == ObjectKind::mesh) meshes = {static_cast<int>(s.index)};
    return std::ranges::any_of(meshes, [&](int mesh) {
        const auto& used = session.scene().meshes[static_cast<std::size_t>(mesh)].triangle_material;
        return std::ranges::find(used, static_cast<std::uint32_t>(material)) != used.end();
    });
}

/// Shows the emission of each emissive material: artists count panels as lights.
void emissive_materials(PanelContext& c) {
    const Scene& scene = c.session.scene();
    std::vector<std::size_t> emissive;
    for (std::size_t i = 0; i < scene.materials.size(); ++i)
        if (has_emission(scene.materials[i])) emissive.push_back(i);
    if (emissive.empty()) return;
    const std::vector<Material> shown = c.session.edited_values().materials;
    const bool other = c.outliner.lit != c.session.selection;
    ImGui::PushID("surfaces");
    for (std::size_t k = 0; k < std::min(emissive.size(), kMostListed); ++k) {
        const std::size_t i = emissive[k];
        ImGui::PushID(static_cast<int>(i));
        const std::string& name = scene.materials[i].name;
        open_if(c, other && is_selected(c.session, i));
        if (foldable(name.empty() ? c.session.name_of({ObjectKind::material, i}) : name, false))
            emission_property(c, i, shown[i]);
        ImGui::PopID();
    }
    ImGui::PopID();
    if (emissive.size() > kMostListed)
        faint_text(fmt::format("The section Scene lists all {} emissive materials.", emissive.size()));
}

}  // namespace

void light_section(PanelContext& c) {
    SceneEdits& edits = c.session.edits;
    const Scene& scene = c.session.scene();
    heading("Environment");
    environment_properties(c);
    heading("Surfaces");
    if (std::ranges::any_of(scene.materials, has_emission))
        slider("All emission", edits.emission, 0, 100, "%.3f", "factor on all emissive surfaces", kLogarithmic);
    emissive_materials(c);
    if (!c.session.in_pages()) {
        checkbox("Ground", edits.ground,
                 "adds a level floor below the scene, of which only the shadows on it are seen");
        checkbox(
            "Straight light through glass", edits.straight_glass,
            "lets light pass clear solid glass without bending it, so that it reaches rooms behind windows; a bias");
    }
    checkbox("Clay", edits.clay, "gives all surfaces one grey diffuse material");
    heading("Lights");
    const std::vector<PunctualLight>& lights = c.session.lights();
    if (button("Add lamp ...", "adds a lamp before the surface in the middle of the picture"))
        ImGui::OpenPopup("kinds");
    if (ImGui::BeginPopup("kinds")) {
        lamp_kinds(c);
        close_by_escape();
        ImGui::EndPopup();
    }
    action_button(c, Action::duplicate_lamp, true, "Duplicate");
    if (c.session.selection.kind == ObjectKind::light) {
        const bool added = c.session.added_lamp(c.session.selection.index) != nullptr;
        const bool off = HiddenObjects(c.session).contains(c.session.selection);
        action_button(c, Action::hide_object, true, added ? "Delete" : off ? "Switch on" : "Switch off");
    }
    if (lights.empty())
        faint_text("The scene has no lights beside environment and emissive surfaces.");
    else
        checkbox("Show lamps", c.session.modes.show_lamps, setting("show-lamps").help);
    ImGui::PushID("lights");
    const Selection& selected = c.session.selection;
    for (std::size_t i = 0; i < lights.size(); ++i) {
        const Selection object{ObjectKind::light, i};
        if (i >= kMostListed && selected != object) continue;
        const std::string& name = lights[i].name;
        ImGui::PushID(static_cast<int>(i));
        open_if(c, selected == object);
        if (foldable(name.empty() ? c.session.name_of({ObjectKind::light, i}) : name, lights.size() <= 3))
            light_properties_of(c, i);
        ImGui::PopID();
    }
    ImGui::PopID();
    if (lights.size() > kMostListed) faint_text(fmt::format("The section Scene lists all {} lights.", lights.size()));
    c.outliner.lit = selected;
}

}  // namespace halflight::view
