#include "tools/view/statistics_panel.h"

#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>

#include "tools/view/statistics_text.h"

namespace halflight::view {
namespace {

void text(const std::string& line) {
    ImGui::TextUnformatted(line.c_str());
}

void lines(const char* title, bool open, const std::vector<std::string>& all) {
    if (all.empty() || !ImGui::TreeNodeEx(title, open ? ImGuiTreeNodeFlags_DefaultOpen : 0)) return;
    for (const std::string& line : all) text(line);
    ImGui::TreePop();
}

void picture_lines(const Picture& picture) {
    const RenderStats& s = picture.result.stats;
    const Image& image = picture.result.beauty;
    text(fmt::format("{} x {}, {} sample{}", image.width, image.height, s.samples, s.samples == 1 ? "" : "s"));
    if (picture.relmse) text(fmt::format("Estimated relMSE of the mean {:.3g}", *picture.relmse));
    text(fmt::format("{:.3f} s/sample, {:.2f} Mpaths/s", s.render_seconds / std::max(s.samples, 1),
                     1e-6 * static_cast<double>(s.paths) / std::max(s.render_seconds, 1e-9)));
    text(fmt::format("Prepared in {:.2f} s", s.prepare_seconds));
    for (const std::string& line : memory_lines(s)) text(line);
    for (const BadValues& bad : s.bad_values)
        if (bad.total() > 0)
            text(fmt::format("{}: {} NaN, {} infinite, {} negative", bad.component, bad.nans, bad.infinities,
                             bad.negatives));
}

void time_lines(const PassHistory& history) {
    if (history.passes().empty() || !ImGui::TreeNodeEx("Pass times", ImGuiTreeNodeFlags_DefaultOpen)) return;
    ImGui::PushTextWrapPos(-1);  // keeps each pass on one line
    for (const PassHistory::Pass& pass : history.passes()) {
        const std::vector<float>& ms = pass.milliseconds;
        ImGui::PushID(pass.name.c_str());
        ImGui::PlotLines("", ms.data(), static_cast<int>(ms.size()), 0, nullptr, 0,
                         1.2f * *std::max_element(ms.begin(), ms.end()), {40, ImGui::GetTextLineHeight()});
        ImGui::PopID();
        ImGui::SameLine();
        text(fmt::format("{:7.2f} ms {}", ms.back(), pass.name));
    }
    ImGui::PopTextWrapPos();
    ImGui::TreePop();
}

void choose_culling(rays::Culling& chosen) {
    if (!ImGui::BeginCombo("Culling", rays::name(chosen))) return;
    for (const rays::Culling one : rays::culling_methods())
        if (ImGui::Selectable(name(one), one == chosen)) chosen = one;
    ImGui::EndCombo();
}

}  // namespace

void statistics_panel(Session& session, const PanelState& now) {
    ImGui::SliderInt("Samples", &session.samples, 1, 1 << 16, "%d",
                     ImGuiSliderFlags_AlwaysClamp | ImGuiSliderFlags_Logarithmic);
    ImGui::Checkbox("Estimate error", &session.estimate_error);
    choose_culling(session.culling);
    ImGui::Checkbox("Measure passes and culling (slower)", &session.measure);
    text(now.status.device);
    if (!now.picture) return;
    picture_lines(*now.picture);
    time_lines(*now.history);
    lines("Culling", session.measure, culling_lines(now.picture->result.stats));
    lines("Pages", true, paging_lines(now.picture->result.stats));
    lines("Left out", false, left_out_lines(now.picture->result.stats));
}

}  // namespace halflight::view
