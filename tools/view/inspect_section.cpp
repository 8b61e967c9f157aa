// The section "Inspect": pixel under the mouse, histogram, memory, frame graph, culling.
#include <fmt/format.h>

#include <algorithm>
#include <cfloat>
#include <cmath>

#include "tools/cli/pass_groups.h"
#include "tools/view/inspection.h"
#include "tools/view/side_bar.h"
#include "tools/view/statistics_text.h"
#include "tools/view/widgets.h"

namespace halflight::view {
namespace {

void lines(const char* title, bool open, const std::vector<std::string>& all) {
    if (all.empty() || !ImGui::CollapsingHeader(title, open ? ImGuiTreeNodeFlags_DefaultOpen : 0)) return;
    for (const std::string& line : all) text(line);
}

void picture_lines(const Picture& picture) {
    const RenderStats& s = picture.result.stats;
    const Image& image = picture.result.beauty;
    value("Size", fmt::format("{} x {}, {} sample{}", image.width, image.height, s.samples, s.samples == 1 ? "" : "s"));
    if (picture.relmse)
        value("Error", fmt::format("{:.3g} (relMSE {:.3g})", std::sqrt(*picture.relmse), *picture.relmse),
              "estimated for the mean of the samples, relative to the pixels' values");
    value("Sample", fmt::format("{:.3g} s", s.render_seconds / std::max(s.samples, 1)), "mean time per sample");
    value("Paths",
          fmt::format("{:.3g} million/s", 1e-6 * static_cast<double>(s.paths) / std::max(s.render_seconds, 1e-9)));
    value("Preparation", fmt::format("{:.2f} s", s.prepare_seconds));
    for (const BadValues& bad : s.bad_values)
        if (bad.total() > 0)
            text(fmt::format("{}: {} NaN, {} infinite, {} negative", bad.component, bad.nans, bad.infinities,
                             bad.negatives));
}

void probe_lines(const PanelContext& c) {
    if (!ImGui::CollapsingHeader("Pixel", ImGuiTreeNodeFlags_DefaultOpen)) return;
    const auto known = c.now.pixel ? probe(*c.now.picture, c.now.complete, c.now.size, *c.now.pixel) : std::nullopt;
    if (!known) return faint_text("Move the mouse over the picture.");
    for (const auto& [name, text] : lines_of(*known, c.session.scene())) value(name.c_str(), text);
}

/// Labels the last item, a histogram: powers of two below it, and a line at luminance 1 after exposure.
void histogram_axis(float stops) {
    constexpr float kEach = 6;  // stops between two labels
    const ImVec2 from = ImGui::GetItemRectMin(), to = ImGui::GetItemRectMax();
    const auto x = [&](float at) {
        return from.x + (to.x - from.x) * (at - Histogram::kLowest) / (Histogram::kHighest - Histogram::kLowest);
    };
    ImDrawList& list = *ImGui::GetWindowDrawList();
    if (const float one = x(-stops); one > from.x && one < to.x)
        list.AddLine({one, from.y}, {one, to.y}, ImGui::GetColorU32(ImGuiCol_Text, 0.6f));
    for (float at = Histogram::kLowest; at <= Histogram::kHighest; at += kEach) {
        const std::string label = at == 0 ? "1" : fmt::format("2^{:g}", at);
        const float width = ImGui::CalcTextSize(label.c_str()).x;
        list.AddText({std::clamp(x(at) - width / 2, from.x, to.x - width), to.y},
                     ImGui::GetColorU32(ImGuiCol_TextDisabled), label.c_str());
    }
    ImGui::Dummy({0, ImGui::GetTextLineHeight()});
}

void histogram_lines(const PanelContext& c) {
    if (!ImGui::CollapsingHeader("Histogram", ImGuiTreeNodeFlags_DefaultOpen)) return;
    const Histogram h = histogram(c.now.picture->result.beauty, c.session.transform.stops());
    ImGui::PlotHistogram("##histogram", h.shares.data(), Histogram::kBins, 0, nullptr, 0, FLT_MAX,
                         {ImGui::GetContentRegionAvail().x, 4 * ImGui::GetFontSize()});
    tooltip("shares of the pixels over their luminance before exposure; the line is 1 after exposure");
    histogram_axis(c.session.transform.stops());
    value("Mean, maximum", fmt::format("{:.4g}, {:.4g}", h.mean, h.maximum), "luminance before exposure");
    value("Black, above 1", fmt::format("{:.1f} %, {:.1f} %", 100 * h.black, 100 * h.above),
          "shares of the pixels; above 1 after exposure");
}

/// Shows a pass: its times, sample by sample, and the last one.
void pass_row(const PassHistory::Pass& pass) {
    const std::vector<float>& ms = pass.milliseconds;
    ImGui::PushID(pass.name.c_str());
    ImGui::PlotLines("", ms.data(), static_cast<int>(ms.size()), 0, nullptr, 0, 1.2f * std::ranges::max(ms),
                     {3 * ImGui::GetFontSize(), ImGui::GetTextLineHeight()});
    ImGui::PopID();
    ImGui::SameLine();
    text(fmt::format("{:.2f} ms  {}", ms.back(), pass.name));
}

/// Shows the render graph in a short form: its groups of passes in their order, with their times. An open group shows
/// its passes.
void frame_graph(PanelContext& c) {
    if (!ImGui::CollapsingHeader("Frame graph", ImGuiTreeNodeFlags_DefaultOpen)) return;
    checkbox("Measure", c.session.measure,
             "shows the passes of a sample and their times; slower: the device finishes each pass before the next");
    const std::vector<PassHistory::Pass>& passes = c.now.history->passes();
    std::vector<PassTime> times;
    for (const PassHistory::Pass& pass : passes) times.push_back({pass.name, 1, 1e-3 * pass.milliseconds.back()});
    for (const PassGroup& group : pass_groups(times)) {
        const ImVec2 at = ImGui::GetCursorScreenPos();
        const float width = static_cast<float>(group.share) * ImGui::GetContentRegionAvail().x;
        ImGui::GetWindowDrawList()->AddRectFilled(at, {at.x + width, at.y + ImGui::GetTextLineHeight()},
                                                  ImGui::GetColorU32(ImGuiCol_PlotHistogram, 0.4f));
        const std::string title =
            fmt::format("{:.2f} ms  {:.0f} %  {}", 1e3 * group.seconds, 100 * group.share, group.name);
        if (!ImGui::TreeNode(group.name.c_str(), "%s", title.c_str())) continue;
        for (const PassHistory::Pass& pass : passes)
            if (group_of(pass.name) == group.name) pass_row(pass);
        ImGui::TreePop();
    }
}

}  // namespace

void inspect_section(PanelContext& c) {
    heading("Picture");
    value("Device", c.now.status.device);
    if (!c.now.picture) return faint_text("There is no picture yet.");
    const RenderStats& stats = c.now.picture->result.stats;
    picture_lines(*c.now.picture);
    probe_lines(c);
    histogram_lines(c);
    if (ImGui::CollapsingHeader("Memory", ImGuiTreeNodeFlags_DefaultOpen))
        for (const auto& [name, size, help] : memory_rows(stats)) value(name, size, help);
    frame_graph(c);
    lines("Culling", c.session.measure, culling_lines(stats));
    lines("Pages", true, paging_lines(stats));
    lines("Left out", false, left_out_lines(stats));
}

}  // namespace halflight::view
