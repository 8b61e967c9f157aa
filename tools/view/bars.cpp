#include "tools/view/bars.h"

#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <utility>

#include "tools/view/clock.h"
#include "tools/view/inspector.h"
#include "tools/view/keys.h"
#include "tools/view/widgets.h"

namespace halflight::view {
namespace {

constexpr ImGuiWindowFlags kFixed = ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove |
                                    ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoBringToFrontOnFocus;

/// Rows of the shortcut sheet beside the table of actions.
constexpr std::pair<const char*, const char*> kMouse[] = {
    {"click", "selects the object under the mouse"},
    {"left drag", "orbits around the focus; turns the head in the modes Fly and Walk"},
    {"middle drag, Shift and drag", "moves sideways"},
    {"right drag, wheel", "moves closer or farther"},
    {"double click", "sets the focus on the surface under the mouse"},
    {"W A S D Q E", "fly, or walk horizontally; with Shift four times as fast"},
    {"wheel in the modes Fly and Walk", "changes the speed"},
};

ImVec2 vec(const ivec2& v) {
    return {static_cast<float>(v.x), static_cast<float>(v.y)};
}

void camera_items(PanelContext& c) {
    constexpr std::pair<const char*, dvec3> kSides[] = {{"front (+Z)", {0, 0, 1}}, {"back (-Z)", {0, 0, -1}},
                                                        {"right (+X)", {1, 0, 0}}, {"left (-X)", {-1, 0, 0}},
                                                        {"top (+Y)", {0, 1, 0}},   {"bottom (-Y)", {0, -1, 0}}};
    if (ImGui::BeginMenu("View from")) {
        for (const auto& [side, direction] : kSides)
            if (ImGui::MenuItem(side)) c.requests.pose = seen_from(c.session.pose(), direction);
        ImGui::EndMenu();
    }
    ImGui::Separator();
    const auto& cameras = c.session.scene().cameras;
    for (std::size_t i = 0; i < cameras.size(); ++i) {
        ImGui::PushID(static_cast<int>(i));
        const std::string name = cameras[i].name.empty() ? fmt::format("camera {}", i) : cameras[i].name;
        if (ImGui::MenuItem(name.c_str(), nullptr, c.session.scene_camera() == i)) c.session.take_camera(i);
        ImGui::PopID();
    }
}

void comparison_items(PanelContext& c) {
    ImGui::Separator();
    for (const ComparisonModeRow& row : kComparisonModes) {
        const bool on = c.now.comparing && c.now.comparison == row.mode;
        if (ImGui::MenuItem(row.name, nullptr, on, c.now.comparing)) c.requests.comparison = row.mode;
        tooltip(row.help);
    }
}

void lamp_items(PanelContext& c) {
    ImGui::Separator();
    if (!ImGui::BeginMenu("Add")) return;
    lamp_kinds(c);
    ImGui::EndMenu();
}

void layer_items(PanelContext& c) {
    ImGui::Separator();
    if (!ImGui::BeginMenu("Layer")) return;
    for (const std::string& name : layer_view_names())
        if (ImGui::MenuItem(name.c_str(), nullptr, c.session.layer_view.layer == name))
            c.session.layer_view.layer = name;
    ImGui::EndMenu();
}

}  // namespace

void menu_bar(PanelContext& c) {
    if (!ImGui::BeginMainMenuBar()) return;
    for (const Menu menu : {Menu::file, Menu::edit, Menu::view, Menu::camera, Menu::compare, Menu::help}) {
        if (!ImGui::BeginMenu(name(menu))) continue;
        for (const ActionRow& row : actions()) {
            if (row.menu != menu || row.action == Action::recall) continue;
            if (ImGui::MenuItem(row.label, row.keys, false, c.now.available(row.action)))
                c.requests.actions.push_back(row.action);
            tooltip(row.help);
        }
        if (menu == Menu::edit) lamp_items(c);
        if (menu == Menu::view) layer_items(c);
        if (menu == Menu::camera) camera_items(c);
        if (menu == Menu::compare) comparison_items(c);
        close_by_escape();
        ImGui::EndMenu();
    }
    ImGui::EndMainMenuBar();
}

void status_line(const Rectangle& where, const Progress& progress, const std::string& right) {
    ImGui::SetNextWindowPos(vec(where.origin));
    ImGui::SetNextWindowSize(vec(where.size));
    ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, {ImGui::GetStyle().WindowPadding.x, 0});
    ImGui::PushStyleVar(ImGuiStyleVar_WindowMinSize, {1, 1});
    ImGui::Begin("status line", nullptr, kFixed);
    ImDrawList& list = *ImGui::GetWindowDrawList();
    const ImVec2 at = ImGui::GetWindowPos(), size = ImGui::GetWindowSize();
    const float done = static_cast<float>(share_done(progress));
    list.AddRectFilled(at, {at.x + done * size.x, at.y + 0.12f * size.y}, ImGui::GetColorU32(ImGuiCol_PlotHistogram));
    ImGui::SetCursorPosY(0.5f * (size.y - ImGui::GetTextLineHeight()));
    const std::string line = progress_line(progress);
    ImGui::TextUnformatted(line.c_str());
    const float left = ImGui::GetItemRectMax().x - at.x + 2 * ImGui::GetFontSize();
    const float start = ImGui::GetWindowContentRegionMax().x - ImGui::CalcTextSize(right.c_str()).x;
    if (start > left) {  // the text on the right is left out if it would cover the progress
        ImGui::SameLine(start);
        ImGui::TextUnformatted(right.c_str());
    }
    ImGui::End();
    ImGui::PopStyleVar(2);
}

void waiting_text(const Rectangle& area, const Progress& progress) {
    const std::string line = progress_line(progress);
    const ImVec2 size = ImGui::CalcTextSize(line.c_str());
    const ImVec2 middle = vec(area.origin + area.size / 2);
    ImGui::GetBackgroundDrawList()->AddText({middle.x - size.x / 2, middle.y - size.y / 2},
                                            ImGui::GetColorU32(ImGuiCol_Text), line.c_str());
}

void shortcut_sheet(bool& open) {
    if (!open) return;
    const ImVec2 window = ImGui::GetIO().DisplaySize;
    ImGui::SetNextWindowPos({window.x / 2, window.y / 2}, ImGuiCond_Always, {0.5f, 0.5f});
    ImGui::SetNextWindowSize({std::min(46 * ImGui::GetFontSize(), window.x), 0});
    ImGui::SetNextWindowSizeConstraints({0, 0}, window);
    ImGui::Begin("Shortcuts", &open,
                 ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoCollapse);
    if (ImGui::BeginTable("keys", 2, ImGuiTableFlags_RowBg)) {
        ImGui::TableSetupColumn("input", ImGuiTableColumnFlags_WidthStretch, 1);
        ImGui::TableSetupColumn("effect", ImGuiTableColumnFlags_WidthStretch, 2);
        const auto row = [](const char* input, const char* effect) {
            ImGui::TableNextRow();
            ImGui::TableNextColumn();
            ImGui::TextUnformatted(input);
            ImGui::TableNextColumn();
            text(effect);
        };
        for (const auto& [input, effect] : kMouse) row(input, effect);
        for (const ActionRow& action : actions()) row(action.keys, action.help);
        ImGui::EndTable();
    }
    if (key_pressed(ImGuiKey_Escape)) open = false;
    ImGui::End();
}

void messages(const Rectangle& area, Toasts& toasts) {
    const float gap = ImGui::GetStyle().ItemSpacing.y;
    const float middle = static_cast<float>(area.origin.x) + 0.5f * static_cast<float>(area.size.x);
    auto bottom = static_cast<float>(area.end().y) - gap;
    const float top = bottom - 0.5f * static_cast<float>(area.size.y);
    std::optional<std::size_t> dismissed;
    const auto& all = toasts.all();
    const ImGuiStyle& style = ImGui::GetStyle();
    const float wrap = std::max(0.8f * static_cast<float>(area.size.x), 8 * ImGui::GetFontSize());
    const float close = ImGui::CalcTextSize("x").x + 2 * style.FramePadding.x + style.ItemSpacing.x;
    for (std::size_t i = all.size(); i-- > 0;) {
        const Toasts::Toast& toast = all[i];
        const std::string words = toast.count > 1 ? fmt::format("{} (x{})", toast.text, toast.count) : toast.text;
        const ImVec2 size = ImGui::CalcTextSize(words.c_str(), nullptr, false, wrap);
        const float height = size.y + 2 * style.WindowPadding.y;
        if (i + 1 < all.size() && bottom - height < top) break;
        // Dear ImGui would give the window the size of its last text.
        ImGui::SetNextWindowSize({size.x + 2 * style.WindowPadding.x + 1 + (toast.error ? close : 0), height});
        ImGui::SetNextWindowPos({middle, bottom}, ImGuiCond_Always, {0.5f, 1});
        ImGui::SetNextWindowBgAlpha(0.9f);
        ImGui::Begin(fmt::format("message {}", i).c_str(), nullptr,
                     ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoSavedSettings |
                         ImGuiWindowFlags_NoFocusOnAppearing |
                         (toast.error ? 0 : ImGuiWindowFlags_NoInputs));  // clicks reach the picture behind
        ImGui::PushTextWrapPos(style.WindowPadding.x + wrap);
        if (toast.error) ImGui::PushStyleColor(ImGuiCol_Text, kErrorColor);
        ImGui::TextUnformatted(words.c_str());
        if (toast.error) ImGui::PopStyleColor();
        ImGui::PopTextWrapPos();
        if (toast.error) {
            ImGui::SameLine();
            if (ImGui::SmallButton("x")) dismissed = i;
        }
        bottom = ImGui::GetWindowPos().y - gap;
        ImGui::End();
    }
    if (dismissed) toasts.dismiss(*dismissed);
}

}  // namespace halflight::view
