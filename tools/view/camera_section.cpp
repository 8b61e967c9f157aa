// The section "Camera": cameras of the scene, mouse mode, lens, size of the picture, bookmarks.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "tools/view/side_bar.h"
#include "tools/view/widgets.h"

namespace halflight::view {
namespace {

void choose_camera(PanelContext& c) {
    const auto& cameras = c.session.scene().cameras;
    const auto now = c.session.scene_camera();
    const auto title = [&](std::size_t i) {
        return cameras[i].name.empty() ? fmt::format("camera {}", i) : cameras[i].name;
    };
    label("Camera", "camera of the scene; moving it makes it free");
    const float width =
        ImGui::GetContentRegionAvail().x - ImGui::GetFrameHeight() - 2 * ImGui::GetStyle().FramePadding.x;
    if (!ImGui::BeginCombo("##camera", now ? shortened(title(*now), width).c_str() : "Free",
                           ImGuiComboFlags_HeightLarge))
        return;
    for (std::size_t i = 0; i < cameras.size(); ++i) {
        ImGui::PushID(static_cast<int>(i));
        if (ImGui::Selectable(title(i).c_str(), now == i)) c.session.take_camera(i);
        ImGui::PopID();
    }
    close_by_escape();
    ImGui::EndCombo();
}

void mouse_mode(Navigation& navigation) {
    using Mode = NavigationMode;
    if (radio("Orbit", navigation.mode == Mode::orbit, "a drag orbits around the focus")) navigation.mode = Mode::orbit;
    if (radio("Fly", navigation.mode == Mode::fly, "a drag turns the head; W A S D Q E fly", true))
        navigation.mode = Mode::fly;
    if (radio("Walk", navigation.mode == Mode::walk, "a drag turns the head; W A S D Q E walk horizontally", true))
        navigation.mode = Mode::walk;
    if (navigation.mode != Mode::orbit)
        slider("Speed", navigation.speed, kLeastSpeed, kMostSpeed, "%.3g m/s",
               "the wheel changes it; Shift moves four times as fast", kLogarithmic);
}

void lens(PanelContext& c) {
    heading("Lens");
    Lens& lens = c.session.transform.camera.lens;
    bool blurs = lens.blurs();
    const auto blur = [](RenderSettings& s) { s.camera.lens = {.aperture = 1, .focus = {.kind = Focus::Kind::point}}; };
    if (checkbox("Depth of field", blurs, "blurs what is out of focus; L focuses on the surface under the mouse",
                 c.session.against(blur)))
        c.session.set_depth_of_field(blurs);
    if (button(c.now.picking ? "Click into the picture ..." : "Pick focus",
               "focuses on the surface that is clicked next, as does L under the mouse"))
        c.requests.pick_focus = true;
    if (!lens.blurs()) return;
    auto distance = static_cast<float>(lens.focus.distance);
    if (lens.focus.kind == Focus::Kind::point)
        value("Focus", fmt::format("at {:.3f}, {:.3f} of the picture", lens.focus.point.x, lens.focus.point.y));
    else if (std::isinf(distance))
        value("Focus", "at infinity");
    else if (slider("Focus", distance, 0.01f, 1000, "%.3f m", "distance along the camera's axis", kLogarithmic))
        lens.focus.distance = double{distance};
    auto diameter = static_cast<float>(lens.aperture);
    if (lens.aperture == 0)
        slider("F-number", "fstop", lens.fstop, "f/%.1f", kLogarithmic);
    else if (slider("Aperture", diameter, 0.1f, 1000, "%.1f mm", "diameter of the aperture", kLogarithmic))
        lens.aperture = double{diameter};
    // An aperture has no blades or at least three.
    int corners = std::max(lens.blades, 2);
    if (slider("Blades", corners, 2, 16, "blades of the aperture", kClamp, corners == 2 ? "round" : "%d"))
        lens.blades = corners == 2 ? 0 : corners;
    auto degrees = static_cast<float>(lens.rotation);
    if (lens.blades > 0 && slider("Rotation", degrees, -180, 180, "%.0f deg", "rotation of the aperture"))
        lens.rotation = double{degrees};
}

void size(PanelContext& c) {
    heading("Picture");
    label("Size", "width x height in pixels; Enter takes it");
    std::array<char, 16> typed{};
    fmt::format_to_n(typed.begin(), typed.size() - 1, "{}x{}", c.now.size.x, c.now.size.y);
    if (ImGui::InputText("##size", typed.data(), typed.size(),
                         ImGuiInputTextFlags_EnterReturnsTrue | ImGuiInputTextFlags_AutoSelectAll))
        c.requests.size = typed.data();
    constexpr const char* kSizes[] = {"640x360", "960x540", "1280x720", "1920x1080"};
    for (const char* const& size : kSizes)
        if (button(size, "renders the picture with this size", &size != kSizes)) c.requests.size = size;
    bool fills = c.now.fills_window;
    if (checkbox("Fill the window", fills, "resizing the window changes the size of the picture"))
        c.requests.fill_window = fills;
}

void bookmarks(PanelContext& c) {
    heading("Bookmarks");
    auto& all = c.session.bookmarks;
    action_button(c, Action::bookmark);
    for (std::size_t i = 0; i < all.size(); ++i) {
        ImGui::PushID(static_cast<int>(i));
        if (ImGui::Button(all[i].name.c_str())) c.requests.pose = all[i].pose;
        tooltip(i < 9 ? fmt::format("returns to the view ({})", i + 1).c_str() : "returns to the view");
        ImGui::SameLine();
        const bool gone = ImGui::SmallButton("x");
        tooltip("removes the bookmark");
        ImGui::PopID();
        if (!gone) continue;
        c.requests.done.push_back(fmt::format("Removed the bookmark \"{}\"", all[i].name));
        all.erase(all.begin() + static_cast<std::ptrdiff_t>(i));
    }
}

}  // namespace

void camera_section(PanelContext& c) {
    heading("View");
    choose_camera(c);
    mouse_mode(c.navigation);
    CameraPose pose = c.session.pose();
    auto degrees = static_cast<float>(glm::degrees(pose.vertical_fov));
    if (!pose.orthographic && slider("Field of view", degrees, 5, 120, "%.1f deg", "vertical field of view")) {
        pose.vertical_fov = glm::radians(double{degrees});
        c.requests.pose = pose;
    }
    if (!pose.orthographic) {
        // The sensor is as long as the longer side of the picture.
        const double set = c.session.transform.camera.lens.sensor;
        const double sensor = set > 0 ? set : Lens::kUsualSensor;
        const double longer = std::max(double(c.now.size.x) / std::max(c.now.size.y, 1), 1.0);
        auto length = static_cast<float>(sensor / 2 / (std::tan(pose.vertical_fov / 2) * longer));
        if (slider("Focal length", length, 8, 300, "%.1f mm",
                   fmt::format("with a sensor of {:.4g} mm along the longer side of the picture", sensor).c_str(),
                   kLogarithmic)) {
            pose.vertical_fov = 2 * std::atan(sensor / 2 / (double{length} * longer));
            c.requests.pose = pose;
        }
    }
    action_button(c, Action::reset_camera, false, "Reset");
    action_button(c, Action::previous_view, true, "Previous");
    action_button(c, Action::next_view, true, "Next");
    action_button(c, Action::frame_selected, false);
    action_button(c, Action::frame_all, true);
    size(c);
    lens(c);
    bookmarks(c);
}

}  // namespace halflight::view
