#include "tools/view/panels.h"

#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>

namespace halflight::view {
namespace {

// Numbers can be typed into a slider, too: none that a settings file may not have.
constexpr ImGuiSliderFlags kClamp = ImGuiSliderFlags_AlwaysClamp;
constexpr ImGuiSliderFlags kLogarithmic = ImGuiSliderFlags_AlwaysClamp | ImGuiSliderFlags_Logarithmic;

/// A list to choose one of; true where another one was.
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

void text(const std::string& line) {
    ImGui::TextUnformatted(line.c_str());
}

void camera_panel(Session& session, Navigation& navigation, Asked& asked) {
    const auto& cameras = session.scene().cameras;
    const auto now = session.scene_camera();
    const auto title = [&](std::size_t i) {
        return cameras[i].name.empty() ? fmt::format("camera {}", i) : cameras[i].name;
    };
    if (ImGui::BeginCombo("camera", now ? title(*now).c_str() : "(free)")) {
        for (std::size_t i = 0; i < cameras.size(); ++i) {
            ImGui::PushID(static_cast<int>(i));
            if (ImGui::Selectable(title(i).c_str(), now == i)) session.take_camera(i);
            ImGui::PopID();
        }
        ImGui::EndCombo();
    }
    int manner = static_cast<int>(navigation.manner);
    ImGui::RadioButton("orbit", &manner, static_cast<int>(Manner::orbit));
    ImGui::SameLine();
    ImGui::RadioButton("fly (W A S D Q E)", &manner, static_cast<int>(Manner::fly));
    navigation.manner = static_cast<Manner>(manner);
    if (navigation.manner == Manner::fly)
        ImGui::SliderFloat("speed", &navigation.speed, 0.01f, 100, "%.2f", kLogarithmic);
    CameraPose pose = session.pose();
    auto degrees = static_cast<float>(glm::degrees(pose.vertical_fov));
    if (!pose.orthographic && ImGui::SliderFloat("field of view", &degrees, 5, 120, "%.1f deg", kClamp)) {
        pose.vertical_fov = glm::radians(double{degrees});
        asked.pose = pose;
    }
    if (ImGui::Button("reset (R)")) session.reset_camera();
    ImGui::SameLine();
    if (ImGui::Button("bookmark")) session.bookmark();
    for (std::size_t i = 0; i < session.bookmarks.size(); ++i) {
        ImGui::PushID(static_cast<int>(i));
        if (ImGui::Button(session.bookmarks[i].name.c_str())) asked.pose = session.bookmarks[i].pose;
        ImGui::SameLine();
        const bool gone = ImGui::SmallButton("x");
        ImGui::PopID();
        if (gone) session.bookmarks.erase(session.bookmarks.begin() + static_cast<std::ptrdiff_t>(i));
    }
}

void view_panel(Session& session) {
    choose("seen", session.view, views());
    ImGui::PushTextWrapPos();
    text(description(session.view));
    ImGui::PopTextWrapPos();
}

void color_panel(Session& session, const ColorConfig& colors) {
    ViewTransform& t = session.transform;
    ImGui::SliderFloat("exposure", &t.exposure, -10, 10, "%.2f stops", kClamp);
    std::string display = t.display.empty() ? colors.default_display() : t.display;
    if (choose("display", display, colors.displays())) {
        t.display = display;
        t.view.clear();
    }
    std::string view = t.view.empty() ? colors.default_view(display) : t.view;
    if (choose("view", view, colors.views(display))) t.view = view;
    std::vector<std::string> looks = colors.looks();
    if (looks.empty()) return;
    looks.insert(looks.begin(), "(the view's)");
    std::string look = t.look.empty() ? looks.front() : t.look;
    if (choose("look", look, looks)) t.look = look == looks.front() ? "" : look;
}

void factor(const char* label, float& value) {
    ImGui::SliderFloat(label, &value, 0, 100, "%.3f", kLogarithmic);
}

void light_panel(Session& session) {
    SceneEdits& edits = session.edits;
    const Scene& scene = session.scene();
    if (!scene.environment.black()) {
        factor("environment", edits.environment_intensity);
        auto degrees = static_cast<float>(edits.environment_rotation);
        if (scene.environment.map.width > 0 && ImGui::SliderFloat("rotation", &degrees, -180, 180, "%.1f deg", kClamp))
            edits.environment_rotation = double{degrees};
    }
    if (std::ranges::any_of(scene.materials, has_emission)) factor("emission", edits.emission);
    for (std::size_t i = 0; i < scene.lights.size(); ++i) {
        float value = i < edits.lights.size() ? edits.lights[i] : 1;
        ImGui::PushID(static_cast<int>(i));
        factor(scene.lights[i].name.empty() ? "light" : scene.lights[i].name.c_str(), value);
        ImGui::PopID();
        if (value == (i < edits.lights.size() ? edits.lights[i] : 1)) continue;
        edits.lights.resize(scene.lights.size(), 1);
        edits.lights[i] = value;
    }
    ImGui::Checkbox("clay", &edits.clay);
    ImGui::SliderInt("bounces", &session.bounces, 0, 16, "%d", kClamp);
}

void statistics_panel(Session& session, const Situation& now) {
    ImGui::SliderInt("samples", &session.samples, 1, 1 << 16, "%d", kLogarithmic);
    ImGui::Checkbox("measure passes (slower)", &session.measure);
    text(now.status.device);
    if (!now.picture) return;
    const RenderStats& s = now.picture->result.stats;
    const Image& image = now.picture->result.beauty;
    text(fmt::format("{} x {}, {} samples", image.width, image.height, s.samples));
    text(fmt::format("{:.3f} s/sample, {:.2f} Mpaths/s", s.render_seconds / std::max(s.samples, 1),
                     1e-6 * static_cast<double>(s.paths) / std::max(s.render_seconds, 1e-9)));
    text(fmt::format("prepared in {:.2f} s, {:.0f} MiB on the device", s.prepare_seconds,
                     static_cast<double>(s.gpu_bytes) / (1 << 20)));
    for (const BadValues& bad : s.bad_values)
        if (bad.total() > 0)
            text(fmt::format("{}: {} NaN, {} infinite, {} negative", bad.component, bad.nans, bad.infinities,
                             bad.negatives));
    if (!s.passes.empty() && ImGui::TreeNode("time of passes")) {
        for (const PassTime& pass : s.passes)
            text(fmt::format("{:7.2f} ms  {}", 1e3 * pass.seconds / std::max(s.samples, 1), pass.name));
        ImGui::TreePop();
    }
    if (ImGui::TreeNode("left out")) {
        for (const LeftOut& l : s.left_out) text(fmt::format("{}: {}", l.what, l.fact));
        ImGui::TreePop();
    }
}

void message_panel(const Situation& now, Asked& asked) {
    const std::string& error = now.message.empty() ? now.status.error : now.message;
    if (error.empty()) return;
    const ImVec2 size = ImGui::GetIO().DisplaySize;
    ImGui::SetNextWindowPos({size.x / 2, size.y - 20}, ImGuiCond_Always, {0.5f, 1});
    ImGui::Begin("message", nullptr, ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_AlwaysAutoResize);
    text(error);
    if (!now.message.empty()) {
        ImGui::SameLine();
        asked.read_message = ImGui::SmallButton("x");
    }
    ImGui::End();
}

}  // namespace

Asked panels(Session& session, const ColorConfig& colors, Navigation& navigation, const Situation& now) {
    Asked asked;
    ImGui::SetNextWindowPos({10, 10}, ImGuiCond_FirstUseEver);
    ImGui::SetNextWindowSize({320, std::max(ImGui::GetIO().DisplaySize.y - 20, 100.0f)}, ImGuiCond_FirstUseEver);
    ImGui::Begin("halflight (H hides)");
    ImGui::PushItemWidth(-110);
    text(now.status.activity.empty() ? "ready" : now.status.activity);
    const auto open = [](const char* section) {
        return ImGui::CollapsingHeader(section, ImGuiTreeNodeFlags_DefaultOpen);
    };
    if (open("Camera")) camera_panel(session, navigation, asked);
    if (open("What is seen")) view_panel(session);
    if (open("Colour")) color_panel(session, colors);
    if (open("Light")) light_panel(session);
    if (open("Statistics")) statistics_panel(session, now);
    ImGui::Separator();
    asked.screenshot = ImGui::Button("screenshot .png");
    ImGui::SameLine();
    asked.exr = ImGui::Button(".exr");
    ImGui::SameLine();
    asked.save = ImGui::Button("save settings");
    ImGui::PopItemWidth();
    ImGui::End();
    message_panel(now, asked);
    return asked;
}

}  // namespace halflight::view
