#include "tools/view/overlay.h"

#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>

#include "tools/common/color_map.h"

namespace halflight::view {
namespace {

constexpr ImU32 kText = IM_COL32(255, 255, 255, 255);
constexpr ImU32 kBehind = IM_COL32(0, 0, 0, 160);
constexpr float kMargin = 10;

/// Draws text on a dark background, wrapped at the width of the area, and moved to stay inside the area. `align` is the
/// share of the text that is left of x. Returns the y at which the next label may begin.
float label(const LabelArea& room, float x, float y, float align, const std::string& text) {
    ImDrawList& list = *ImGui::GetBackgroundDrawList();
    const float width = room.right - room.left;
    const ImVec2 size = ImGui::CalcTextSize(text.c_str(), nullptr, false, width);
    const float left = std::max(std::min(x - align * size.x, room.right - size.x), room.left);
    list.AddRectFilled({left - 4, y - 2}, {left + size.x + 4, y + size.y + 2}, kBehind, 3);
    list.AddText(nullptr, 0, {left, y}, kText, text.c_str(), nullptr, width);
    return y + size.y + kMargin;
}

void draw_scale(const Scale& scale) {
    constexpr int kSteps = 64;
    constexpr float kHeight = 10;
    const float width = std::max(192.0f, ImGui::CalcTextSize(scale.unit.c_str()).x);
    ImDrawList& list = *ImGui::GetBackgroundDrawList();
    const ImVec2 window = ImGui::GetIO().DisplaySize;
    const float line = ImGui::GetTextLineHeight();
    const float left = window.x - kMargin - width, top = window.y - kMargin - kHeight;
    list.AddRectFilled({left - 6, top - 2 * line - 10}, {window.x - kMargin + 6, window.y - kMargin + 6}, kBehind, 3);
    for (int i = 0; i < kSteps; ++i) {
        const vec3 c = magma((static_cast<float>(i) + 0.5f) / kSteps);
        const float x = left + width * static_cast<float>(i) / kSteps;
        list.AddRectFilled({x, top}, {x + width / kSteps, top + kHeight},
                           ImGui::ColorConvertFloat4ToU32({c.r, c.g, c.b, 1}));
    }
    const std::string most = fmt::format("{:g}", scale.top);
    list.AddText({left, top - 2 * line - 6}, kText, scale.unit.c_str());
    list.AddText({left, top - line - 3}, kText, fmt::format("{:g}", scale.bottom).c_str());
    list.AddText({left + width - ImGui::CalcTextSize(most.c_str()).x, top - line - 3}, kText, most.c_str());
}

/// Reacts to the mouse for a few pixels on both sides of the line.
void drag_line(float& split) {
    constexpr float kReach = 6;
    const ImVec2 window = ImGui::GetIO().DisplaySize;
    ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, {0, 0});
    ImGui::PushStyleVar(ImGuiStyleVar_WindowMinSize, {1, 1});
    ImGui::SetNextWindowPos({split * window.x - kReach, 0});
    ImGui::SetNextWindowSize({2 * kReach, window.y});
    ImGui::Begin("split", nullptr,
                 ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoBackground | ImGuiWindowFlags_NoMove |
                     ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoBringToFrontOnFocus);
    ImGui::InvisibleButton("line", {2 * kReach, window.y});
    if (ImGui::IsItemActive()) split = std::clamp(ImGui::GetIO().MousePos.x / std::max(window.x, 1.0f), 0.0f, 1.0f);
    if (ImGui::IsItemHovered() || ImGui::IsItemActive()) ImGui::SetMouseCursor(ImGuiMouseCursor_ResizeEW);
    ImGui::End();
    ImGui::PopStyleVar(2);
}

/// Draws line and labels of a comparison; returns the y at which more labels may begin.
float draw_split(const LabelArea& room, const std::string& here, const std::string& other, float& split) {
    drag_line(split);
    const ImVec2 window = ImGui::GetIO().DisplaySize;
    const float x = split * window.x;
    ImGui::GetBackgroundDrawList()->AddLine({x, 0}, {x, window.y}, kText, 2);
    const float next = label(room, x - kMargin, kMargin, 1, "A: " + here);
    return label(room, x + kMargin, next, 0, "B: " + other);
}

}  // namespace

void draw_overlay(const Overlay& overlay, float& split) {
    if (overlay.scale) draw_scale(*overlay.scale);
    LabelArea room = overlay.label_area.value_or(LabelArea{0, ImGui::GetIO().DisplaySize.x});
    room.left += kMargin, room.right -= kMargin;
    float next = overlay.other ? draw_split(room, overlay.here, *overlay.other, split) : kMargin;
    for (const std::string& notice : overlay.notices)
        next = label(room, 0.5f * (room.left + room.right), next, 0.5f, notice);
}

}  // namespace halflight::view
