#include "tools/view/object_overlay.h"

#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "api/halflight/edit_text.h"
#include "engine/scene/light_types.h"

namespace halflight::view {
namespace {

constexpr ImU32 kLine = IM_COL32(255, 160, 32, 255), kBehindLine = IM_COL32(0, 0, 0, 160);
constexpr ImU32 kLight = IM_COL32(255, 240, 160, 255);
constexpr ImU32 kAxes[] = {IM_COL32(240, 70, 80, 255), IM_COL32(110, 200, 60, 255), IM_COL32(70, 130, 255, 255),
                           IM_COL32(235, 235, 235, 255), kLight};
constexpr ImU32 kLit = IM_COL32(255, 230, 60, 255);
constexpr double kHandle = 90, kHandleReach = 9;  // pixels of the window at scale 1

/// Draws in pixels of the picture.
class Pen {
  public:
    Pen(const Rectangle& picture, const Rectangle& clip, const ivec2& size)
        : list_(*ImGui::GetBackgroundDrawList()), origin_(picture.origin), scale_(dvec2(picture.size) / dvec2(size)) {
        list_.PushClipRect({float(clip.origin.x), float(clip.origin.y)}, {float(clip.end().x), float(clip.end().y)},
                           true);
    }
    ~Pen() { list_.PopClipRect(); }
    Pen(const Pen&) = delete;
    Pen& operator=(const Pen&) = delete;

    ImVec2 at(const dvec2& p) const {
        // Far points are moved nearer along the axes: the list is clipped, and floats stay exact enough.
        const dvec2 point = glm::clamp(origin_ + scale_ * p, -1e5, 1e5);
        return {static_cast<float>(point.x), static_cast<float>(point.y)};
    }
    void lines(const std::vector<PictureLine>& all, ImU32 color, float width) {
        for (const auto& [c, w] : {std::pair(kBehindLine, width + 2), std::pair(color, width)})
            for (const PictureLine& line : all) list_.AddLine(at(line[0]), at(line[1]), c, w);
    }
    ImDrawList& list() { return list_; }

  private:
    ImDrawList& list_;
    dvec2 origin_, scale_;
};

/// Draws the end of a handle: an arrow that moves, or a box that scales.
void draw_end(Pen& pen, const Gizmo::Handle& handle, GizmoMode mode, ImU32 color, float size) {
    const ImVec2 from = pen.at(handle.lines.back()[0]), to = pen.at(handle.lines.back()[1]);
    if (mode == GizmoMode::scale) {
        pen.list().AddRectFilled({to.x - size / 2, to.y - size / 2}, {to.x + size / 2, to.y + size / 2}, color);
        return;
    }
    const float length = std::hypot(to.x - from.x, to.y - from.y);
    if (!(length > 0)) return;
    const ImVec2 d{size * (to.x - from.x) / length, size * (to.y - from.y) / length};
    pen.list().AddTriangleFilled({to.x + d.x, to.y + d.y}, {to.x - d.y / 2, to.y + d.x / 2},
                                 {to.x + d.y / 2, to.y - d.x / 2}, color);
}

/// Returns the edit that a drag changes, as the command line has it.
std::string dragged_text(const Session& session) {
    const std::size_t i = session.selection.index;
    if (session.selection.kind == ObjectKind::light) {
        const LightEdit* const edit = find_light_edit(session.edits, session.references().lights[i]);
        return edit ? text(*edit) : "";
    }
    const auto found =
        std::ranges::find(session.edits.nodes, session.references().nodes[i], &NamedEdit<NodeEdit>::name);
    return found == session.edits.nodes.end() ? "" : text(found->edit);
}

void draw_lights(Pen& pen, const Session& session, const ivec2& size, float scale) {
    const Projection projection(session.camera(), size);
    const auto& lights = session.edited_values().lights;
    for (std::size_t i = 0; i < lights.size(); ++i) {
        if (!row_of(lights[i].type).has_position) continue;
        const auto pixel = projection.pixel(lights[i].position);
        if (!pixel) continue;
        const ImVec2 p = pen.at(*pixel);
        const bool selected = session.selection == Selection{ObjectKind::light, i};
        const ImU32 color = selected ? kLine : kLight;
        pen.list().AddCircleFilled(p, 6 * scale, kBehindLine);
        pen.list().AddCircle(p, 5 * scale, color, 0, 2 * scale);
        if (selected) pen.list().AddCircle(p, 9 * scale, color, 0, 2 * scale);
    }
}

}  // namespace

double ObjectOverlay::handle_length(const Rectangle& picture, const ivec2& size, float scale) {
    return kHandle * double{scale} * size.y / std::max(picture.size.y, 1);
}

double ObjectOverlay::handle_reach(const Rectangle& picture, const ivec2& size, float scale) {
    return kHandleReach * double{scale} * size.y / std::max(picture.size.y, 1);
}

std::optional<std::size_t> ObjectOverlay::light_at(const Session& session, const ivec2& size, const dvec2& point,
                                                   double reach) {
    const Projection projection(session.camera(), size);
    const auto& lights = session.edited_values().lights;
    for (std::size_t i = 0; i < lights.size(); ++i) {
        const auto pixel = projection.pixel(lights[i].position);
        if (row_of(lights[i].type).has_position && pixel && glm::length(*pixel - point) < reach) return i;
    }
    return std::nullopt;
}

void ObjectOverlay::draw(const Session& session, const Gizmo& gizmo, const WindowLayout& layout, const ivec2& size,
                         float scale, std::optional<int> lit, bool lights) {
    if (size.x == 0 || size.y == 0) return;
    const Rectangle& picture = layout.picture;
    {
        Pen inside(picture, picture, size);
        if (lights) draw_lights(inside, session, size, scale);
        inside.lines(outline_.lines(session, size), kLine, 1.5f * scale);
    }
    Pen pen(picture, layout.area, size);
    for (const Gizmo::Handle& handle : gizmo.handles(session, size, handle_length(picture, size, scale))) {
        const ImU32 color = lit == handle.axis ? kLit : kAxes[std::min(handle.axis, Gizmo::kSize)];
        pen.lines(handle.lines, color, (lit == handle.axis ? 4 : 3) * scale);
        if (handle.axis < Gizmo::kAll && gizmo.mode != GizmoMode::rotate && !handle.lines.empty())
            draw_end(pen, handle, gizmo.mode, color, 12 * scale);
    }
    if (!gizmo.dragging()) return;
    const std::string words = dragged_text(session);
    const ImVec2 extent = ImGui::CalcTextSize(words.c_str());
    const float left = float(picture.origin.x) + (float(picture.size.x) - extent.x) / 2;
    const float top = float(picture.end().y) - 3 * extent.y;
    pen.list().AddRectFilled({left - 4, top - 2}, {left + extent.x + 4, top + extent.y + 2}, kBehindLine, 3);
    pen.list().AddText({left, top}, IM_COL32(255, 255, 255, 255), words.c_str());
}

}  // namespace halflight::view
