#include "tools/view/gui.h"

#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_opengl3.h>
#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <imgui.h>

#include <algorithm>

#include "engine/core/error.h"

namespace halflight::view {

Gui::Gui(Window& window) {
    IMGUI_CHECKVERSION();
    ImGui::CreateContext();
    ImGui::GetIO().IniFilename = nullptr;  // Dear ImGui writes no settings file
    ImGui::StyleColorsDark();
    ImGui::GetStyle().WindowRounding = 4;
    ImGui_ImplGlfw_InitForOpenGL(window.handle(), true);
    if (ImGui_ImplOpenGL3_Init("#version 450 core")) return;
    ImGui_ImplGlfw_Shutdown();
    ImGui::DestroyContext();
    throw Error("window", "Dear ImGui cannot use this OpenGL context");
}

Gui::~Gui() {
    ImGui_ImplOpenGL3_Shutdown();
    ImGui_ImplGlfw_Shutdown();
    ImGui::DestroyContext();
}

void Gui::begin() {
    ImGui_ImplOpenGL3_NewFrame();
    ImGui_ImplGlfw_NewFrame();
    ImGui::NewFrame();
}

Input Gui::input() const {
    const ImGuiIO& io = ImGui::GetIO();
    Input in;
    in.seconds = double{io.DeltaTime};
    if (!io.WantCaptureMouse) {
        in.drag = dvec2(io.MouseDelta.x, io.MouseDelta.y) / double{std::max(io.DisplaySize.y, 1.0f)};
        in.left = ImGui::IsMouseDown(ImGuiMouseButton_Left);
        in.middle = ImGui::IsMouseDown(ImGuiMouseButton_Middle);
        in.right = ImGui::IsMouseDown(ImGuiMouseButton_Right);
        in.shift = io.KeyShift;
        in.wheel = double{io.MouseWheel};
        if (ImGui::IsMouseDoubleClicked(ImGuiMouseButton_Left))
            in.double_click =
                dvec2(io.MousePos.x * io.DisplayFramebufferScale.x, io.MousePos.y * io.DisplayFramebufferScale.y);
    }
    if (!io.WantCaptureKeyboard && !io.KeyCtrl) {
        const auto axis = [](int more, int less) {
            return (ImGui::IsKeyDown(more) ? 1.0 : 0.0) - (ImGui::IsKeyDown(less) ? 1.0 : 0.0);
        };
        in.movement = {axis(GLFW_KEY_D, GLFW_KEY_A), axis(GLFW_KEY_E, GLFW_KEY_Q), axis(GLFW_KEY_W, GLFW_KEY_S)};
    }
    return in;
}

void Gui::draw() {
    ImGui::Render();
    ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
}

}  // namespace halflight::view
