// The list of objects with search and visibility.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

#include "tools/view/inspector.h"
#include "tools/view/outliner.h"
#include "tools/view/widgets.h"

namespace halflight::view {
namespace {

/// Returns the heading above the objects of a kind.
const char* title_of(ObjectKind kind) {
    switch (kind) {
        case ObjectKind::light:
            return "Lights";
        case ObjectKind::camera:
            return "Cameras";
        case ObjectKind::node:
            return "Nodes";
        case ObjectKind::material:
            return "Materials";
        case ObjectKind::mesh:
            return "Meshes";
        case ObjectKind::none:
        case ObjectKind::environment:
            break;
    }
    return "Environment";
}

void row(const Outliner::Row& r, const HiddenObjects& hidden, PanelContext& c) {
    const float line = ImGui::GetTextLineHeight();
    const bool is_hidden = hidden.contains(r.object);
    if (can_be_hidden(r.object, c.session)) {
        bool shown = !is_hidden;
        ImGui::PushStyleVar(ImGuiStyleVar_FramePadding, {0, 0});
        if (ImGui::Checkbox("##shown", &shown)) {
            set_shown(c.session, r.object, shown);
            c.requests.done.push_back(fmt::format("{} {}", shown ? "Shown:" : "Hidden:", c.session.name_of(r.object)));
        }
        ImGui::PopStyleVar();
        tooltip("shows or hides the object, with everything below it");
    } else {
        ImGui::Dummy({line, line});
    }
    ImGui::SameLine(0, ImGui::GetStyle().ItemInnerSpacing.x + 0.75f * line * static_cast<float>(r.depth));
    if (is_hidden) ImGui::PushStyleColor(ImGuiCol_Text, ImGui::GetStyleColorVec4(ImGuiCol_TextDisabled));
    const std::string label = shortened(r.label, ImGui::GetContentRegionAvail().x) + "###label";
    if (ImGui::Selectable(label.c_str(), c.session.selection == r.object, ImGuiSelectableFlags_AllowDoubleClick)) {
        c.session.selection = r.object;
        if (r.object.kind == ObjectKind::camera && ImGui::IsMouseDoubleClicked(ImGuiMouseButton_Left))
            c.session.take_camera(r.object.index);
    }
    if (is_hidden) ImGui::PopStyleColor();
    // A label that is cut has its text in the tooltip.
    if (r.object.kind == ObjectKind::camera)
        tooltip((r.label + ": a double click looks through it").c_str());
    else
        tooltip(r.label.c_str());
}

}  // namespace

void object_list(PanelContext& c) {
    constexpr float kMost = 11, kLeast = 5;  // height of the list, lines
    constexpr float kShare = 0.35f;          // share of the section that the list takes
    label("Search", "shows objects whose names contain the text");
    ImGui::InputText("##search", c.outliner.search.data(), c.outliner.search.size());
    // An object that is selected elsewhere ends a search that does not find it.
    const Selection selected_now = c.session.selection;
    if (c.outliner.scrolled_to != selected_now && selected_now.kind != ObjectKind::none) {
        const auto& found = c.outliner.rows(c.session);
        if (std::ranges::find(found, selected_now, &Outliner::Row::object) == found.end()) c.outliner.search = {};
        c.outliner.folded[static_cast<std::size_t>(selected_now.kind)] = false;
    }
    const auto& rows = c.outliner.rows(c.session);
    const bool searching = c.outliner.search[0] != 0;
    const HiddenObjects hidden(c.session);
    const float line_height = ImGui::GetTextLineHeightWithSpacing();
    const float height = std::clamp(kShare * ImGui::GetWindowHeight(), kLeast * line_height, kMost * line_height);
    ImGui::BeginChild("objects", {0, height}, true);
    if (std::exchange(c.outliner.listed, c.outliner.search) != c.outliner.search) ImGui::SetScrollY(0);
    // A heading stands before the objects of each kind; a click on it folds them.
    std::vector<int> lines;  // index of a row; -1 - index: heading before that row
    std::array<int, 8> counts{};
    for (std::size_t i = 0; i < rows.size(); ++i) {
        const auto index = static_cast<int>(i);
        const auto kind = static_cast<std::size_t>(rows[i].object.kind);
        if (counts[kind]++ == 0 && rows[i].object.kind != ObjectKind::environment) lines.push_back(-1 - index);
        if (searching || !c.outliner.folded[kind]) lines.push_back(index);
    }
    if (c.outliner.scrolled_to != c.session.selection) {  // a click in the picture shows the row, too
        c.outliner.scrolled_to = c.session.selection;
        const auto selected = std::ranges::find_if(lines, [&](int line) {
            return line >= 0 && rows[static_cast<std::size_t>(line)].object == c.session.selection;
        });
        const float top = line_height * static_cast<float>(selected - lines.begin());
        const bool seen = top >= ImGui::GetScrollY() && top + line_height < ImGui::GetScrollY() + height;
        if (selected != lines.end() && !seen) ImGui::SetScrollY(std::max(top - 2 * line_height, 0.0f));
    }
    ImGuiListClipper clipper;
    clipper.Begin(static_cast<int>(lines.size()), line_height);
    while (clipper.Step())
        for (int i = clipper.DisplayStart; i < clipper.DisplayEnd; ++i) {
            const int line = lines[static_cast<std::size_t>(i)];
            if (line >= 0) {
                const Outliner::Row& r = rows[static_cast<std::size_t>(line)];
                ImGui::PushID(static_cast<int>(r.object.kind));
                ImGui::PushID(static_cast<int>(r.object.index));
                row(r, hidden, c);
                ImGui::PopID();
                ImGui::PopID();
                continue;
            }
            const ObjectKind kind = rows[static_cast<std::size_t>(-1 - line)].object.kind;
            const auto k = static_cast<std::size_t>(kind);
            ImGui::SetNextItemOpen(searching || !c.outliner.folded[k]);
            const bool open = ImGui::TreeNodeEx(title_of(kind),
                                                ImGuiTreeNodeFlags_NoTreePushOnOpen | ImGuiTreeNodeFlags_SpanAvailWidth,
                                                "%s (%d)", title_of(kind), counts[k]);
            if (!searching) c.outliner.folded[k] = !open;
        }
    if (rows.empty()) faint_text("No object has this text in its name.");
    ImGui::EndChild();
}

}  // namespace halflight::view
