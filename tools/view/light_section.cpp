// The section "Light": environment, emissive surfaces, lamps, clay.
#include <fmt/format.h>

#include <algorithm>

#include "tools/view/inspector.h"
#include "tools/view/widgets.h"

namespace halflight::view {
namespace {

constexpr std::size_t kMost = 100;  // lights, and emissive materials, that are listed; the section Scene lists all

/// Shows the emission of each emissive material: artists count panels as lights.
void emissive_materials(PanelContext& c) {
    const Scene& scene = c.session.scene();
    std::vector<std::size_t> emissive;
    for (std::size_t i = 0; i < scene.materials.size(); ++i)
        if (has_emission(scene.materials[i])) emissive.push_back(i);
    if (emissive.empty()) return;
    const std::vector<Material> shown = c.session.edited_values().materials;
    ImGui::PushID("surfaces");
    for (std::size_t k = 0; k < std::min(emissive.size(), kMost); ++k) {
        const std::size_t i = emissive[k];
        ImGui::PushID(static_cast<int>(i));
        const std::string& name = scene.materials[i].name;
        if (foldable(name.empty() ? c.session.name_of({ObjectKind::material, i}) : name, false))
            emission_property(c, i, shown[i]);
        ImGui::PopID();
    }
    ImGui::PopID();
    if (emissive.size() > kMost)
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
    checkbox("Clay", edits.clay, "gives all surfaces one grey diffuse material");
    heading("Lights");
    if (scene.lights.empty()) faint_text("The scene has no lights beside environment and emissive surfaces.");
    ImGui::PushID("lights");
    for (std::size_t i = 0; i < std::min(scene.lights.size(), kMost); ++i) {
        const std::string& name = scene.lights[i].name;
        ImGui::PushID(static_cast<int>(i));
        if (foldable(name.empty() ? c.session.name_of({ObjectKind::light, i}) : name, scene.lights.size() <= 3))
            light_properties_of(c, i);
        ImGui::PopID();
    }
    ImGui::PopID();
    if (scene.lights.size() > kMost)
        faint_text(fmt::format("The section Scene lists all {} lights.", scene.lights.size()));
}

}  // namespace halflight::view
