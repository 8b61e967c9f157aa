#include "tools/view/keys.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

namespace halflight::view {
namespace {

struct KeyPair {
    ImGuiKey ours;
    int glfw;
};

// Keys that fields of Dear ImGui, or panels, ask for.
constexpr KeyPair kKeys[] = {
    {ImGuiKey_Tab, GLFW_KEY_TAB},
    {ImGuiKey_LeftArrow, GLFW_KEY_LEFT},
    {ImGuiKey_RightArrow, GLFW_KEY_RIGHT},
    {ImGuiKey_UpArrow, GLFW_KEY_UP},
    {ImGuiKey_DownArrow, GLFW_KEY_DOWN},
    {ImGuiKey_PageUp, GLFW_KEY_PAGE_UP},
    {ImGuiKey_PageDown, GLFW_KEY_PAGE_DOWN},
    {ImGuiKey_Home, GLFW_KEY_HOME},
    {ImGuiKey_End, GLFW_KEY_END},
    {ImGuiKey_Insert, GLFW_KEY_INSERT},
    {ImGuiKey_Delete, GLFW_KEY_DELETE},
    {ImGuiKey_Backspace, GLFW_KEY_BACKSPACE},
    {ImGuiKey_Space, GLFW_KEY_SPACE},
    {ImGuiKey_Enter, GLFW_KEY_ENTER},
    {kKeypadEnter, GLFW_KEY_KP_ENTER},
    {ImGuiKey_Escape, GLFW_KEY_ESCAPE},
    {ImGuiKey_A, GLFW_KEY_A},
    {ImGuiKey_C, GLFW_KEY_C},
    {ImGuiKey_V, GLFW_KEY_V},
    {ImGuiKey_X, GLFW_KEY_X},
    {ImGuiKey_Y, GLFW_KEY_Y},
    {ImGuiKey_Z, GLFW_KEY_Z},
};

}  // namespace

#if IMGUI_VERSION_NUM >= 18900

void use_glfw_keys() {
    ImGui::GetIO().ConfigInputTrickleEventQueue = false;  // EventQueue::take() distributes events to frames
}

void tell_key(int code, bool down, const Modifiers& held) {
    ImGuiIO& io = ImGui::GetIO();
    for (const auto& [ours, glfw] : kKeys)
        if (glfw == code) io.AddKeyEvent(ours, down);
    io.AddKeyEvent(ImGuiMod_Ctrl, held.ctrl);
    io.AddKeyEvent(ImGuiMod_Shift, held.shift);
    io.AddKeyEvent(ImGuiMod_Alt, held.alt);
    io.AddKeyEvent(ImGuiMod_Super, held.super);
}

bool key_pressed(ImGuiKey key) {
    return ImGui::IsKeyPressed(key, false);
}

#else

void use_glfw_keys() {
    for (const auto& [ours, glfw] : kKeys) ImGui::GetIO().KeyMap[ours] = glfw;
}

void tell_key(int code, bool down, const Modifiers& held) {
    ImGuiIO& io = ImGui::GetIO();
    io.KeysDown[code] = down;
    io.KeyCtrl = held.ctrl;
    io.KeyShift = held.shift;
    io.KeyAlt = held.alt;
    io.KeySuper = held.super;
}

bool key_pressed(ImGuiKey key) {
    return ImGui::IsKeyPressed(ImGui::GetKeyIndex(key), false);
}

#endif

}  // namespace halflight::view
