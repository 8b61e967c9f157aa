#include "tools/view/overlay.h"

#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <cmath>

#include "tools/common/color_map.h"

namespace halflight::view {
namespace {

constexpr ImU32 kText = IM_COL32(255, 255, 255, 255);
constexpr ImU32 kBehind = IM_COL32(0, 0, 0, 160);
constexpr float kMargin = 10;

/// Area for labels, pixels of the window.
struct LabelArea {
    float left, right, top, bottom;
};

/// Draws text on a dark background, wrapped at the width of the area, and moved to stay inside the area. `align` is the
/// share of the text that is left of x. Returns the y at which the next label may begin.
float draw_label(const LabelArea& room, float x, float y, float align, const std::string& text) {
    ImDrawList& list = *ImGui::GetBackgroundDrawList();
    const float width = room.right - room.left;
    const ImVec2 size = ImGui::CalcTextSize(text.c_str(), nullptr, false, width);
    const float left = std::max(std::min(x - align * size.x, room.right - size.x), room.left);
    list.AddRectFilled({left - 4, y - 2}, {left + size.x + 4, y + size.y + 2}, kBehind, 3);
    list.AddText(nullptr, 0, {left, y}, kText, text.c_str(), nullptr, width);
    return y + size.y + kMargin;
}

constexpr float kBar = 0.75f;  // height of the bar of a colour scale, lines

/// Returns the height of a colour scale with its background, pixels.
float scale_height() {
    return (kBar + 2) * ImGui::GetTextLineHeight() + 16;
}

void draw_scale(const LabelArea& room, const Scale& scale) {
    constexpr int kSteps = 64;
    const float line = ImGui::GetTextLineHeight(), height = kBar * line;
    const float width = std::max(14 * line, ImGui::CalcTextSize(scale.unit.c_str()).x);
    ImDrawList& list = *ImGui::GetBackgroundDrawList();
    const float left = room.right - width, top = room.bottom - height;
    list.AddRectFilled({left - 6, top - 2 * line - 10}, {room.right + 6, room.bottom + 6}, kBehind, 3);
    for (int i = 0; i < kSteps; ++i) {
        const vec3 c = magma((static_cast<float>(i) + 0.5f) / kSteps);
        const float x = left + width * static_cast<float>(i) / kSteps;
        list.AddRectFilled({x, top}, {x + width / kSteps, top + height},
                           ImGui::ColorConvertFloat4ToU32({c.r, c.g, c.b, 1}));
    }
    const std::string most = fmt::format("{:g}", scale.top);
    list.AddText({left, top - 2 * line - 6}, kText, scale.unit.c_str());
    list.AddText({left, top - line - 3}, kText, fmt::format("{:g}", scale.bottom).c_str());
    list.AddText({left + width - ImGui::CalcTextSize(most.c_str()).x, top - line - 3}, kText, most.c_str());
}

/// Reacts to the mouse for a few pixels on both sides of the line.
void drag_line(const Rectangle& picture, float& split) {
    constexpr float kReach = 6;
    const auto left = static_cast<float>(picture.origin.x), top = static_cast<float>(picture.origin.y);
    const auto width = static_cast<float>(picture.size.x), height = static_cast<float>(picture.size.y);
    ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, {0, 0});
    ImGui::PushStyleVar(ImGuiStyleVar_WindowMinSize, {1, 1});
    ImGui::SetNextWindowPos({left + split * width - kReach, top});
    ImGui::SetNextWindowSize({2 * kReach, height});
    ImGui::Begin("split", nullptr,
                 ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoBackground | ImGuiWindowFlags_NoMove |
                     ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoBringToFrontOnFocus);
    ImGui::InvisibleButton("line", {2 * kReach, height});
    if (ImGui::IsItemActive())
        split = std::clamp((ImGui::GetIO().MousePos.x - left) / std::max(width, 1.0f), 0.0f, 1.0f);
    if (ImGui::IsItemHovered() || ImGui::IsItemActive()) ImGui::SetMouseCursor(ImGuiMouseCursor_ResizeEW);
    ImGui::End();
    ImGui::PopStyleVar(2);
}

/// Draws line and labels of a comparison; returns the y at which more labels may begin.
float draw_split(const LabelArea& room, const Overlay& overlay, float& split) {
    const Rectangle& picture = overlay.picture;
    if (!overlay.shown.empty()) {
        float next = draw_label(room, room.left, room.top, 0, "A: " + overlay.here);
        next = draw_label(room, room.left, next, 0, "B: " + *overlay.other);
        return draw_label(room, room.left, next, 0, "Shown: " + overlay.shown);
    }
    drag_line(picture, split);
    const float x = static_cast<float>(picture.origin.x) + split * static_cast<float>(picture.size.x);
    ImGui::GetBackgroundDrawList()->AddLine({x, static_cast<float>(picture.origin.y)},
                                            {x, static_cast<float>(picture.end().y)}, kText, 2);
    const std::string here = "A: " + overlay.here, other = "B: " + *overlay.other;
    // Each label wraps inside its half. Halves too narrow for text show the labels below each other.
    const float least = 10 * ImGui::GetFontSize();
    LabelArea left = room, right = room;
    left.right = x - kMargin, right.left = x + kMargin;
    const bool beside = left.right - left.left >= least && right.right - right.left >= least;
    if (beside)
        return std::max(draw_label(left, left.right, room.top, 1, here),
                        draw_label(right, right.left, room.top, 0, other));
    return draw_label(room, x + kMargin, draw_label(room, x - kMargin, room.top, 1, here), 0, other);
}

}  // namespace

Rectangle above_scale(Rectangle area) {
    area.size.y -= static_cast<int>(std::ceil(scale_height() + kMargin));
    return area;
}

void draw_overlay(const Overlay& overlay, float& split) {
    const Rectangle& area = overlay.area;
    const LabelArea room{static_cast<float>(area.origin.x) + kMargin, static_cast<float>(area.end().x) - kMargin,
                         static_cast<float>(area.origin.y) + kMargin, static_cast<float>(area.end().y) - kMargin};
    if (overlay.scale) draw_scale(room, *overlay.scale);
    float next = overlay.other ? draw_split(room, overlay, split) : room.top;
    // Notices cover the picture only where there is room neither above nor below it.
    const float lowest = room.bottom - (overlay.scale ? scale_height() + kMargin : 0);
    float below = static_cast<float>(overlay.picture.end().y) + kMargin;
    for (const std::string& notice : overlay.notices) {
        const float height = ImGui::CalcTextSize(notice.c_str(), nullptr, false, room.right - room.left).y;
        const bool above = next + height <= static_cast<float>(overlay.picture.origin.y) || below + height > lowest;
        float& y = above ? next : below;
        y = draw_label(room, 0.5f * (room.left + room.right), y, 0.5f, notice);
    }
}

}  // namespace halflight::view
