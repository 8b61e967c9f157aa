#include "tools/view/navigation.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <imgui.h>

#include <algorithm>
#include <cmath>

namespace halflight::view {

void Navigation::steer(Session& session, const ivec2& size) {
    const ImGuiIO& io = ImGui::GetIO();
    if (!io.WantCaptureMouse) {
        // Of the window's height, as the picture's.
        const dvec2 drag = dvec2(io.MouseDelta.x, io.MouseDelta.y) / double{std::max(io.DisplaySize.y, 1.0f)};
        const bool left = ImGui::IsMouseDown(ImGuiMouseButton_Left);
        const bool sideways = ImGui::IsMouseDown(ImGuiMouseButton_Middle) || (left && io.KeyShift);
        if (drag != dvec2(0) && sideways) {
            session.move(pan(session.pose(), drag));
        } else if (drag != dvec2(0) && left) {
            session.move(manner == Manner::orbit ? orbit(session.pose(), kPi * drag)
                                                 : turn(session.pose(), session.pose().vertical_fov * drag));
        } else if (drag.y != 0 && ImGui::IsMouseDown(ImGuiMouseButton_Right)) {
            session.move(dolly(session.pose(), std::exp(2 * drag.y)));
        }
        if (io.MouseWheel != 0 && manner == Manner::orbit)
            session.move(dolly(session.pose(), std::exp(-0.1 * double{io.MouseWheel})));
        if (io.MouseWheel != 0 && manner == Manner::fly)
            speed = std::clamp(speed * std::exp(0.1f * io.MouseWheel), 0.01f, 100.0f);
        if (ImGui::IsMouseDoubleClicked(ImGuiMouseButton_Left))
            session.focus({io.MousePos.x * io.DisplayFramebufferScale.x, io.MousePos.y * io.DisplayFramebufferScale.y},
                          size);
    }
    fly(session);
}

void Navigation::fly(Session& session) {
    const ImGuiIO& io = ImGui::GetIO();
    moving_ = false;
    if (io.WantCaptureKeyboard || io.KeyCtrl) return;
    const auto axis = [](int more, int less) {
        return (ImGui::IsKeyDown(more) ? 1.0 : 0.0) - (ImGui::IsKeyDown(less) ? 1.0 : 0.0);
    };
    const dvec3 way(axis(GLFW_KEY_D, GLFW_KEY_A), axis(GLFW_KEY_E, GLFW_KEY_Q), axis(GLFW_KEY_W, GLFW_KEY_S));
    if (way == dvec3(0)) return;
    moving_ = true;
    const WorldBounds box = world_bounds(session.scene());
    const double diagonal = box.empty() ? 1 : glm::length(box.upper - box.lower);
    session.move(view::fly(session.pose(), 0.1 * double{speed} * diagonal * double{io.DeltaTime} * way));
}

}  // namespace halflight::view
