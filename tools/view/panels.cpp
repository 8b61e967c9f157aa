#include "tools/view/panels.h"

#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <cmath>

#include "engine/scene/light_types.h"
#include "engine/settings/settings_table.h"
#include "tools/view/statistics_panel.h"

namespace halflight::view {
namespace {

// Values typed into a slider are clamped, too: settings files allow no others.
constexpr ImGuiSliderFlags kClamp = ImGuiSliderFlags_AlwaysClamp;
constexpr ImGuiSliderFlags kLogarithmic = ImGuiSliderFlags_AlwaysClamp | ImGuiSliderFlags_Logarithmic;

/// Shows a slider for a setting of the table, with its help text as tooltip.
void slider(const char* label, const char* name, int& value) {
    const Setting& s = setting(name);
    ImGui::SliderInt(label, &value, static_cast<int>(s.slider_from), static_cast<int>(s.slider_to), "%d", kClamp);
    if (ImGui::IsItemHovered()) ImGui::SetTooltip("%s", s.help);
}
void slider(const char* label, const char* name, float& value, const char* format, ImGuiSliderFlags flags) {
    const Setting& s = setting(name);
    ImGui::SliderFloat(label, &value, static_cast<float>(s.slider_from), static_cast<float>(s.slider_to), format,
                       flags);
    if (ImGui::IsItemHovered()) ImGui::SetTooltip("%s", s.help);
}

/// Shows a combo box; returns whether another item was chosen.
bool choose(const char* label, std::string& chosen, const std::vector<std::string>& all) {
    bool changed = false;
    if (!ImGui::BeginCombo(label, chosen.c_str())) return false;
    for (const std::string& one : all) {
        if (!ImGui::Selectable(one.c_str(), one == chosen)) continue;
        changed = one != chosen;
        chosen = one;
    }
    ImGui::EndCombo();
    return changed;
}

constexpr float kSmall = 640;  // pixels; a panel would cover windows narrower than this
constexpr float kTall = 900;   // pixels; windows of this height have room for all sections

void text(const std::string& line) {
    ImGui::TextUnformatted(line.c_str());
}

/// Puts a button or radio button beside the last item, or below it where the panel is too narrow.
void beside_if_room(const char* label) {
    const ImGuiStyle& style = ImGui::GetStyle();
    const float frame = ImGui::GetFrameHeight() + style.ItemInnerSpacing.x;
    const float right = ImGui::GetWindowPos().x + ImGui::GetWindowContentRegionMax().x;
    if (ImGui::GetItemRectMax().x + style.ItemSpacing.x + frame + ImGui::CalcTextSize(label).x <= right)
        ImGui::SameLine();
}

void camera_panel(Session& session, Navigation& navigation, PanelRequests& requests) {
    const auto& cameras = session.scene().cameras;
    const auto now = session.scene_camera();
    const auto title = [&](std::size_t i) {
        return cameras[i].name.empty() ? fmt::format("camera {}", i) : cameras[i].name;
    };
    if (ImGui::BeginCombo("Camera", now ? title(*now).c_str() : "Free")) {
        for (std::size_t i = 0; i < cameras.size(); ++i) {
            ImGui::PushID(static_cast<int>(i));
            if (ImGui::Selectable(title(i).c_str(), now == i)) session.take_camera(i);
            ImGui::PopID();
        }
        ImGui::EndCombo();
    }
    int mode = static_cast<int>(navigation.mode);
    ImGui::RadioButton("Orbit", &mode, static_cast<int>(NavigationMode::orbit));
    beside_if_room("Fly");
    ImGui::RadioButton("Fly", &mode, static_cast<int>(NavigationMode::fly));
    beside_if_room("Walk (W A S D Q E)");
    ImGui::RadioButton("Walk (W A S D Q E)", &mode, static_cast<int>(NavigationMode::walk));
    navigation.mode = static_cast<NavigationMode>(mode);
    if (navigation.mode != NavigationMode::orbit)
        ImGui::SliderFloat("Speed", &navigation.speed, 0.01f, 100, "%.2f", kLogarithmic);
    CameraPose pose = session.pose();
    auto degrees = static_cast<float>(glm::degrees(pose.vertical_fov));
    if (!pose.orthographic && ImGui::SliderFloat("Field of view", &degrees, 5, 120, "%.1f deg", kClamp)) {
        pose.vertical_fov = glm::radians(double{degrees});
        requests.pose = pose;
    }
    if (ImGui::Button("Reset (R)")) session.reset_camera();
    beside_if_room("Add bookmark");
    if (ImGui::Button("Add bookmark")) session.bookmark();
    for (std::size_t i = 0; i < session.bookmarks.size(); ++i) {
        ImGui::PushID(static_cast<int>(i));
        if (ImGui::Button(session.bookmarks[i].name.c_str())) requests.pose = session.bookmarks[i].pose;
        ImGui::SameLine();
        const bool gone = ImGui::SmallButton("x");
        ImGui::PopID();
        if (gone) session.bookmarks.erase(session.bookmarks.begin() + static_cast<std::ptrdiff_t>(i));
    }
}

void lens_panel(Session& session) {
    Lens& lens = session.transform.camera.lens;
    bool blurs = lens.blurs();
    if (ImGui::Checkbox("Depth of field", &blurs)) {
        if (blurs)
            session.focus_lens(dvec2(0.5), ivec2(1));
        else
            lens.focus = {.kind = Focus::Kind::none};
    }
    text("L focuses on the surface under the mouse.");
    if (!lens.blurs()) return;
    auto distance = static_cast<float>(lens.focus.distance);
    if (lens.focus.kind == Focus::Kind::point)
        text(fmt::format("Focus at {:.3f}, {:.3f} of the picture", lens.focus.point.x, lens.focus.point.y));
    else if (std::isinf(distance))
        text("Focus at infinity");
    else if (ImGui::SliderFloat("Focus", &distance, 0.01f, 1000, "%.3f m", kLogarithmic))
        lens.focus.distance = double{distance};
    auto diameter = static_cast<float>(lens.aperture);
    if (lens.aperture == 0)
        slider("F-number", "fstop", lens.fstop, "f/%.1f", kLogarithmic);
    else if (ImGui::SliderFloat("Aperture", &diameter, 0.1f, 1000, "%.1f mm", kLogarithmic))
        lens.aperture = double{diameter};
    // An aperture has no blades or at least three.
    int corners = std::max(lens.blades, 2);
    if (ImGui::SliderInt("Blades", &corners, 2, 16, corners == 2 ? "round" : "%d", kClamp))
        lens.blades = corners == 2 ? 0 : corners;
    auto degrees = static_cast<float>(lens.rotation);
    if (lens.blades > 0 && ImGui::SliderFloat("Rotation", &degrees, -180, 180, "%.0f deg", kClamp))
        lens.rotation = double{degrees};
}

/// Shows the combo box even if no animation is chosen, so that one can be chosen.
void animation_panel(const Timeline& t, const PanelState& now, PanelRequests& requests) {
    std::vector<std::string> all = {"none", "all"};
    all.insert(all.end(), t.animations.begin(), t.animations.end());
    std::string chosen = t.animation;
    if (choose("Animation", chosen, all)) requests.frame = {chosen, 0};
    if (t.playing.empty()) return;
    int frame = static_cast<int>(std::min(now.frame, std::uint32_t{1} << 24));
    if (ImGui::SliderInt("Frame", &frame, 0, static_cast<int>(t.last), "%d", kClamp))
        requests.frame = {t.animation, static_cast<std::uint32_t>(frame)};
    bool play = now.playing;
    if (ImGui::Checkbox("Play (space)", &play)) requests.play = play;
    ImGui::SameLine();
    text(fmt::format("{:.2f} s of {:.2f}", t.rate.seconds(t.frame), t.rate.seconds(t.last)));
}

void view_panel(Session& session, const PanelState& now, PanelRequests& requests) {
    choose("Layer", session.layer_view.layer, layer_view_names());
    text(description(session.layer_view.layer));
    if (!now.picture) return;
    if (ImGui::Button(now.comparing ? "Update comparison" : "Compare with this picture")) requests.compare = true;
    if (!now.comparing) return;
    beside_if_room("Close comparison");
    if (ImGui::Button("Close comparison")) requests.compare = false;
}

/// Shows the components of the final picture and the maximum path length.
void passes_panel(Session& session) {
    if (session.layer_view.layer == kFinal) {
        for (std::size_t i = 0; i < kComponents.size(); ++i) {
            std::string name(kComponents[i]);
            std::ranges::replace(name, '_', ' ');
            ImGui::Checkbox(name.c_str(), &session.layer_view.components[i]);
        }
    }
    slider("Bounces", "bounces", session.bounces);
}

void modes_panel(PreviewModes& modes) {
    text("Biased: less noise in early pictures. All but the clamp fade out as samples are added.");
    for (const PreviewMode& mode : known_preview_modes())
        ImGui::Checkbox(mode.description, &(modes.preview.*mode.flag));
    bool clamped = modes.clamp > 0;
    if (ImGui::Checkbox("Clamp indirect light", &clamped)) modes.clamp = clamped ? 10.0f : 0.0f;
    if (clamped) slider("Luminance", "clamp", modes.clamp, "%.2f", kLogarithmic);
}

void color_panel(Session& session, const ColorConfig& colors) {
    ViewTransform& t = session.transform;
    float stops = t.exposure.stops;
    slider("Exposure", "exposure", stops, "%.2f stops", kClamp);
    if (stops != t.exposure.stops) t.exposure = stops;
    std::string display = t.display.empty() ? colors.default_display() : t.display;
    if (choose("Display", display, colors.displays())) {
        t.display = display;
        t.view.clear();
    }
    std::string view = t.view.empty() ? colors.default_view(display) : t.view;
    if (choose("View", view, colors.views(display))) t.view = view;
    std::vector<std::string> looks = colors.looks();
    if (looks.empty()) return;
    looks.insert(looks.begin(), "From the view");
    std::string look = t.look.empty() ? looks.front() : t.look;
    if (choose("Look", look, looks)) t.look = look == looks.front() ? "" : look;
}

void factor(const char* label, float& value) {
    ImGui::SliderFloat(label, &value, 0, 100, "%.3f", kLogarithmic);
}

/// Shows a colour picker for a linear colour in [0,1]; returns whether it has changed. The picker shows it
/// gamma-encoded.
bool pick_color(const char* label, vec3& linear) {
    constexpr float kGamma = 2.2f;
    vec3 shown = glm::pow(linear, vec3(1 / kGamma));
    if (!ImGui::ColorEdit3(label, &shown.r, ImGuiColorEditFlags_NoInputs)) return false;
    linear = glm::pow(glm::clamp(shown, 0.0f, 1.0f), vec3(kGamma));
    return true;
}

/// Shows the controls of one light. `diagonal` is that of the scene, world units.
void punctual_light(const PunctualLight& light, float diagonal, LightEdit& edit) {
    factor(light.name.empty() ? "light" : light.name.c_str(), edit.factor);
    vec3 color = edit.color.value_or(color_of(light).color);
    if (pick_color("Colour", color)) edit.color = color;
    if (row_of(light.type).has_position) {
        dvec3 position = edit.position.value_or(light.position);
        if (ImGui::DragScalarN("Position", ImGuiDataType_Double, &position.x, 3, 0.002f * diagonal, nullptr, nullptr,
                               "%.3f"))
            edit.position = glm::clamp(position, kEditPosition.lower, kEditPosition.upper);
    }
    if (row_of(light.type).has_direction) {
        // The angles point towards the source. The zenith is excluded, because the azimuth would be lost there.
        const dvec3 back = -glm::normalize(edit.direction.value_or(dvec3(light.direction)));
        vec2 angles(glm::degrees(std::atan2(back.x, back.z)), glm::degrees(std::asin(std::clamp(back.y, -1.0, 1.0))));
        if (ImGui::DragFloat2("Azimuth, elevation", &angles.x, 0.5f, -360, 360, "%.1f deg")) {
            const dvec2 a = glm::radians(dvec2(angles.x, std::clamp(angles.y, -89.9f, 89.9f)));
            edit.direction = -dvec3(std::cos(a.y) * std::sin(a.x), std::sin(a.y), std::cos(a.y) * std::cos(a.x));
        }
    }
    if (!edit.color && !edit.position && !edit.direction) return;
    if (ImGui::SmallButton("Reset to scene")) edit = LightEdit{edit.factor};
}

void light_panel(Session& session) {
    SceneEdits& edits = session.edits;
    const Scene& scene = session.scene();
    if (!scene.environment.black()) {
        factor("Environment", edits.environment_intensity);
        pick_color("Tint", edits.environment_tint);
        auto degrees = static_cast<float>(edits.environment_rotation);
        if (scene.environment.map.width > 0 && ImGui::SliderFloat("Rotation", &degrees, -180, 180, "%.1f deg", kClamp))
            edits.environment_rotation = double{degrees};
    }
    if (std::ranges::any_of(scene.materials, has_emission)) factor("Emission", edits.emission);
    for (std::size_t i = 0; i < scene.lights.size(); ++i) {
        LightEdit edit = i < edits.lights.size() ? edits.lights[i] : LightEdit();
        const LightEdit before = edit;
        ImGui::PushID(static_cast<int>(i));
        punctual_light(scene.lights[i], static_cast<float>(session.diagonal()), edit);
        ImGui::PopID();
        if (edit == before) continue;
        edits.lights.resize(scene.lights.size());
        edits.lights[i] = edit;
    }
    ImGui::Checkbox("Clay", &edits.clay);
}

/// Returns the wider area beside a panel, or the whole window where that area is narrow.
LabelArea label_area_beside(float left, float width, float window) {
    constexpr float kLeast = 160;
    const LabelArea before{0, left}, after{left + width, window};
    const LabelArea wider = after.right - after.left >= before.right ? after : before;
    return wider.right - wider.left >= kLeast ? wider : LabelArea{0, window};
}

void message_panel(const PanelState& now, PanelRequests& requests) {
    const std::string& error = !now.message.empty()        ? now.message
                               : !now.status.error.empty() ? now.status.error
                                                           : now.status.shader_error;
    if (error.empty()) return;
    const ImVec2 size = ImGui::GetIO().DisplaySize;
    ImGui::SetNextWindowPos({size.x / 2, size.y - 20}, ImGuiCond_Always, {0.5f, 1});
    ImGui::Begin("message", nullptr, ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_AlwaysAutoResize);
    text(error);
    if (!now.message.empty()) {
        ImGui::SameLine();
        requests.dismiss_message = ImGui::SmallButton("x");
    }
    ImGui::End();
}

}  // namespace

PanelRequests panels(Session& session, const ColorConfig& colors, Navigation& navigation, const PanelState& now) {
    PanelRequests requests;
    const ImVec2 size = ImGui::GetIO().DisplaySize;
    ImGui::SetNextWindowPos({10, 10}, ImGuiCond_FirstUseEver);
    ImGui::SetNextWindowSize({std::clamp(0.3f * size.x, 300.0f, 320.0f), std::max(size.y - 20, 100.0f)},
                             ImGuiCond_FirstUseEver);
    ImGui::SetNextWindowCollapsed(size.x < kSmall, ImGuiCond_FirstUseEver);
    ImGui::Begin("Halflight (H hides)");
    ImGui::PushItemWidth(0.55f * ImGui::GetContentRegionAvail().x);
    ImGui::PushTextWrapPos();
    text(now.status.activity.empty() ? "Ready" : now.status.activity);
    const auto open = [&](const char* section, bool first) {
        return ImGui::CollapsingHeader(section, first || size.y > kTall ? ImGuiTreeNodeFlags_DefaultOpen : 0);
    };
    if (open("Camera", false)) camera_panel(session, navigation, requests);
    if (open("Lens", false)) lens_panel(session);
    if (session.timeline().file && open("Animation", true)) animation_panel(session.timeline(), now, requests);
    if (open("Layer", true)) view_panel(session, now, requests);
    if (open("Light paths", true)) passes_panel(session);
    if (open("Colour", false)) color_panel(session, colors);
    if (open("Light", false)) light_panel(session);
    if (open("Preview modes", false)) modes_panel(session.modes);
    if (open("Statistics", true)) statistics_panel(session, now);
    ImGui::Separator();
    requests.screenshot = ImGui::Button("Save .png");
    beside_if_room("Save .exr");
    requests.exr = ImGui::Button("Save .exr");
    beside_if_room("Save settings");
    requests.save = ImGui::Button("Save settings");
    requests.label_area = label_area_beside(ImGui::GetWindowPos().x, ImGui::GetWindowWidth(), size.x);
    ImGui::PopTextWrapPos();
    ImGui::PopItemWidth();
    ImGui::End();
    message_panel(now, requests);
    return requests;
}

}  // namespace halflight::view
