// Keys of Dear ImGui. Up to 1.88 (Debian 12 has 1.86) it reads the state of numbered keys, since 1.89 (Debian 13 has
// 1.90) it takes events.
#pragma once

#include <imgui.h>

namespace halflight::view {

#if IMGUI_VERSION_NUM >= 18900
inline constexpr ImGuiKey kKeypadEnter = ImGuiKey_KeypadEnter;
#else
inline constexpr ImGuiKey kKeypadEnter = ImGuiKey_KeyPadEnter;
#endif

/// Modifier keys that are held.
struct Modifiers {
    bool ctrl = false, shift = false, alt = false, super = false;
};

/// Prepares the current context for keys of GLFW.
void use_glfw_keys();
/// Tells Dear ImGui that a key is pressed or released. code: number of the key in GLFW, in [0, 512).
void tell_key(int code, bool down, const Modifiers& held);
/// Returns whether a key was pressed in the current frame. Repetitions do not count.
bool key_pressed(ImGuiKey key);

}  // namespace halflight::view
