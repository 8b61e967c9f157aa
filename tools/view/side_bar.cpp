#include "tools/view/side_bar.h"

#include <fmt/format.h>

#include <array>

#include "tools/view/widgets.h"

namespace halflight::view {
namespace {

constexpr std::array kSections = {
    Section{"Scene", "file, animation, objects and their properties", scene_section},
    Section{"Camera", "camera, mouse mode, lens, bookmarks", camera_section},
    Section{"Light", "environment, emissive surfaces, lamps", light_section},
    Section{"Look", "layer, components, exposure, colour, comparison", look_section},
    Section{"Quality", "samples, preview modes, tracing", quality_section},
    Section{"Inspect", "pixel under the mouse, histogram, memory, passes", inspect_section},
};

/// Shows the names of all sections as buttons, in lines as wide as the side bar.
void section_buttons(std::string& section) {
    const ImGuiStyle& style = ImGui::GetStyle();
    const float right = ImGui::GetWindowPos().x + ImGui::GetWindowContentRegionMax().x;
    ImGui::PushStyleVar(ImGuiStyleVar_ItemSpacing, {style.ItemInnerSpacing.x, style.ItemSpacing.y});
    for (const Section& s : kSections) {
        const bool open = section == s.name;
        const float width = ImGui::CalcTextSize(s.name).x + 2 * style.FramePadding.x;
        if (&s != &kSections.front() && ImGui::GetItemRectMax().x + style.ItemSpacing.x + width <= right)
            ImGui::SameLine();
        ImGui::PushStyleColor(ImGuiCol_Button,
                              ImGui::GetStyleColorVec4(open ? ImGuiCol_ButtonActive : ImGuiCol_FrameBg));
        if (ImGui::Button(s.name)) section = s.name;
        ImGui::PopStyleColor();
        tooltip(s.help);
    }
    ImGui::PopStyleVar();
    ImGui::Separator();
}

}  // namespace

void action_button(PanelContext& c, Action action, bool same_line, const char* label) {
    const ActionRow& row = row_of(action);
    ImGui::BeginDisabled(!c.now.available(action));
    if (button(label ? label : row.label, fmt::format("{} ({})", row.help, row.keys).c_str(), same_line))
        c.requests.actions.push_back(action);
    ImGui::EndDisabled();
}

std::span<const Section> sections() {
    return kSections;
}

void side_bar(const Rectangle& where, std::string& section, PanelContext& c) {
    ImGui::SetNextWindowPos({static_cast<float>(where.origin.x), static_cast<float>(where.origin.y)});
    ImGui::SetNextWindowSize({static_cast<float>(where.size.x), static_cast<float>(where.size.y)});
    ImGui::Begin("side bar", nullptr,
                 ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoSavedSettings |
                     ImGuiWindowFlags_NoBringToFrontOnFocus);
    section_buttons(section);
    ImGui::BeginChild(section.c_str());  // each section keeps its own place
    for (const Section& s : kSections) {
        if (section != s.name) continue;
        ImGui::PushID(s.name);
        s.declare(c);
        ImGui::PopID();
    }
    ImGui::EndChild();
    ImGui::End();
}

}  // namespace halflight::view
