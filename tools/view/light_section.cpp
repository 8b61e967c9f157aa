// The section "Light": environment, emissive surfaces, lamps, clay.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/scene/light_types.h"
#include "tools/view/side_bar.h"
#include "tools/view/widgets.h"

namespace halflight::view {
namespace {

bool factor(const char* name, float& value, const char* help) {
    return slider(name, value, 0, 100, "%.3f", help, kLogarithmic);
}

/// Shows the controls of one light. `diagonal` is that of the scene, world units.
void punctual_light(const PunctualLight& light, float diagonal, LightEdit& edit) {
    factor("Factor", edit.factor, "factor on the intensity");
    vec3 color = edit.color.value_or(color_of(light).color);
    if (pick_color("Colour", color, "colour of the light")) edit.color = color;
    if (row_of(light.type).has_position) {
        dvec3 position = edit.position.value_or(light.position);
        if (drag("Position", position, 0.002f * diagonal, "world units"))
            edit.position = glm::clamp(position, kEditPosition.lower, kEditPosition.upper);
    }
    if (row_of(light.type).has_direction) {
        // The angles point towards the source. The zenith is excluded, because the azimuth would be lost there.
        const dvec3 back = -glm::normalize(edit.direction.value_or(dvec3(light.direction)));
        vec2 angles(glm::degrees(std::atan2(back.x, back.z)), glm::degrees(std::asin(std::clamp(back.y, -1.0, 1.0))));
        bool changed = slider("Azimuth", angles.x, -180, 180, "%.1f deg", "direction towards the source");
        changed |= slider("Elevation", angles.y, -89.9f, 89.9f, "%.1f deg", "direction towards the source");
        if (changed) {
            const dvec2 a = glm::radians(dvec2(angles));
            edit.direction = -dvec3(std::cos(a.y) * std::sin(a.x), std::sin(a.y), std::cos(a.y) * std::cos(a.x));
        }
    }
    if (!edit.color && !edit.position && !edit.direction) return;
    if (button("Reset to scene", "restores colour, position and direction")) edit = LightEdit{edit.factor};
}

void environment(PanelContext& c) {
    const Environment& environment = c.session.scene().environment;
    if (environment.black()) return;
    SceneEdits& edits = c.session.edits;
    heading("Environment");
    factor("Intensity", edits.environment_intensity, "factor on the radiance of the environment");
    pick_color("Tint", edits.environment_tint, "colour factor on the environment");
    auto degrees = static_cast<float>(edits.environment_rotation);
    if (environment.map.width > 0 &&
        slider("Rotation", degrees, -180, 180, "%.1f deg", "rotation about the vertical axis"))
        edits.environment_rotation = double{degrees};
}

}  // namespace

void light_section(PanelContext& c) {
    SceneEdits& edits = c.session.edits;
    const Scene& scene = c.session.scene();
    environment(c);
    heading("Surfaces");
    if (std::ranges::any_of(scene.materials, has_emission))
        factor("Emission", edits.emission, "factor on all emissive surfaces");
    checkbox("Clay", edits.clay, "gives all surfaces one grey diffuse material");
    for (std::size_t i = 0; i < scene.lights.size(); ++i) {
        const PunctualLight& light = scene.lights[i];
        LightEdit edit = i < edits.lights.size() ? edits.lights[i] : LightEdit();
        const LightEdit before = edit;
        ImGui::PushID(static_cast<int>(i));
        heading(light.name.empty() ? fmt::format("light {}", i).c_str() : light.name.c_str());
        punctual_light(light, static_cast<float>(c.session.diagonal()), edit);
        ImGui::PopID();
        if (edit == before) continue;
        edits.lights.resize(scene.lights.size());
        edits.lights[i] = edit;
    }
}

}  // namespace halflight::view
