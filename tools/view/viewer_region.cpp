// The region of the picture that takes further samples: how it is drawn and shown.
#include <fmt/format.h>
#include <imgui.h>

#include "tools/view/viewer.h"

namespace halflight::view {

void Viewer::ask_for_region() {
    drawing_region_ = true;
    region_corner_.reset();
    tell("Drag a rectangle in the picture; Escape draws none");
}

void Viewer::set_region(const std::optional<Region>& region) {
    const auto newest = thread_.picture();
    if (region && !session_.region) samples_before_region_ = newest ? newest->samples() : 0;
    session_.region = region;
    sample_clock_ = {};
}

bool Viewer::leave_region() {
    region_corner_.reset();
    return std::exchange(drawing_region_, false);
}

bool Viewer::drag_region(const WindowLayout& layout) {
    if (!drawing_region_) return false;
    constexpr int kLeast = 4;  // pixels; shorter drags are taken for clicks
    const dvec2 point = picture_point(layout, picture_size_, gui_.mouse());
    if (!region_corner_) {
        const bool free = !ImGui::GetIO().WantCaptureMouse && layout.picture.contains(gui_.mouse());
        if (free && ImGui::IsMouseClicked(ImGuiMouseButton_Left)) region_corner_ = point;
        return free;
    }
    if (ImGui::IsMouseDown(ImGuiMouseButton_Left)) return true;
    const PixelWindow window = window_between(*region_corner_, point);
    const auto region = region_of(window, picture_size_);
    leave_region();
    if (!region || glm::min(window.size().x, window.size().y) < kLeast) {
        tell("No region was drawn");
        return true;
    }
    set_region(region);
    tell("Only the region takes samples; Ctrl+Shift+B gives them to the whole picture");
    return true;
}

void Viewer::show_region(const WindowLayout& layout) const {
    constexpr ImU32 kLine = IM_COL32(255, 255, 255, 110), kBehind = IM_COL32(0, 0, 0, 110),
                    kOutside = IM_COL32(0, 0, 0, 110);
    const dvec2 origin(layout.picture.origin), end(layout.picture.end());
    const dvec2 scale = dvec2(layout.picture.size) / dvec2(glm::max(picture_size_, ivec2(1)));
    dvec2 a, b;
    if (region_corner_) {
        const dvec2 point = picture_point(layout, picture_size_, gui_.mouse());
        const PixelWindow window = window_between(*region_corner_, point);
        a = origin + scale * dvec2(window.first), b = origin + scale * dvec2(window.end);
    } else if (session_.region) {
        a = origin + dvec2(layout.picture.size) * session_.region->first;
        b = origin + dvec2(layout.picture.size) * session_.region->end;
    } else {
        return;
    }
    a = glm::clamp(a, origin, end), b = glm::clamp(b, origin, end);
    const auto at = [](double x, double y) { return ImVec2(static_cast<float>(x), static_cast<float>(y)); };
    ImDrawList& list = *ImGui::GetBackgroundDrawList();
    if (region_corner_) {
        list.AddRectFilled(at(origin.x, origin.y), at(end.x, a.y), kOutside);
        list.AddRectFilled(at(origin.x, b.y), at(end.x, end.y), kOutside);
        list.AddRectFilled(at(origin.x, a.y), at(a.x, b.y), kOutside);
        list.AddRectFilled(at(b.x, a.y), at(end.x, b.y), kOutside);
    }
    const float width = gui_.scale();
    list.AddRect(at(a.x - 1, a.y - 1), at(b.x + 1, b.y + 1), kBehind, 0, 0, 3 * width);
    list.AddRect(at(a.x, a.y), at(b.x, b.y), kLine, 0, 0, width);
}

}  // namespace halflight::view
