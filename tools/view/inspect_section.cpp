// The section "Inspect": pixel under the mouse, histogram, memory, pass times, culling.
#include <fmt/format.h>

#include <algorithm>
#include <cfloat>
#include <cmath>
#include <functional>

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
    value("Size", fmt::format("{} x {}, {} sample{}", image.width, image.height, s.samples,
                                 s.samples == 1 ? "" : "s"));
    if (picture.relmse)
        value("Error", fmt::format("{:.3g} (relMSE {:.3g})", std::sqrt(*picture.relmse), *picture.relmse),
              "estimated for the mean of the samples, relative to the pixels' values");
    value("Sample", fmt::format("{:.3g} s", s.render_seconds / std::max(s.samples, 1)), "mean time per sample");
    value("Paths", fmt::format("{:.3g} million/s", 1e-6 * static_cast<double>(s.paths) / std::max(s.render_seconds, 1e-9)));
    value("Preparation", fmt::format("{:.2f} s", s.prepare_seconds));
    for (const BadValues& bad : s.bad_values)
        if (bad.total() > 0)
            text(fmt::format("{}: {} NaN, {} infinite, {} negative", bad.component, bad.nans, bad.infinities,
                             bad.negatives));
}

void probe_lines(const PanelContext& c) {
    if (!ImGui::CollapsingHeader("Pixel", ImGuiTreeNodeFlags_DefaultOpen)) return;
    const auto known =
        c.now.pixel ? probe(*c.now.picture, c.now.complete, c.now.size, *c.now.pixel) : std::nullopt;
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
        list.AddText({std::clamp(x(at) - width / 2, from.x, to.x - width), to.y}, ImGui::GetColorU32(ImGuiCol_TextDisabled),
                     label.c_str());
    }
    ImGui::Dummy({0, ImGui::GetTextLineHeight()});
}

void histogram_lines(const PanelContext& c) {
    if (!ImGui::CollapsingHeader("Histogram", ImGuiTreeNodeFlags_DefaultOpen)) return;
    const Histogram h = histogram(c.now.picture->result.beauty, c.session.transform.exposure.stops);
    ImGui::PlotHistogram("##histogram", h.shares.data(), Histogram::kBins, 0, nullptr, 0, FLT_MAX,
                         {ImGui::GetContentRegionAvail().x, 4 * ImGui::GetFontSize()});
    tooltip("shares of the pixels over their luminance before exposure; the line is 1 after exposure");
    histogram_axis(c.session.transform.exposure.stops);
    value("Mean, maximum", fmt::format("{:.4g}, {:.4g}", h.mean, h.maximum), "luminance before exposure");
    value("Black, above 1", fmt::format("{:.1f} %, {:.1f} %", 100 * h.black, 100 * h.above),
          "shares of the pixels; above 1 after exposure");
}

/// Shows the passes, the slowest first, with their shares of the time.
void pass_times(PanelContext& c) {
    if (!ImGui::CollapsingHeader("Pass times", ImGuiTreeNodeFlags_DefaultOpen)) return;
    checkbox("Measure", c.session.measure, "slower: the device finishes each pass before the next");
    std::vector<const PassHistory::Pass*> passes;
    float sum = 0;
    for (const PassHistory::Pass& pass : c.now.history->passes()) {
        passes.push_back(&pass);
        sum += pass.milliseconds.back();
    }
    std::ranges::sort(passes, std::ranges::greater(), [](const auto* pass) { return pass->milliseconds.back(); });
    const float graph = 3 * ImGui::GetFontSize();
    for (const PassHistory::Pass* pass : passes) {
        const std::vector<float>& ms = pass->milliseconds;
        ImGui::PushID(pass->name.c_str());
        ImGui::PlotLines("", ms.data(), static_cast<int>(ms.size()), 0, nullptr, 0,
                         1.2f * *std::max_element(ms.begin(), ms.end()), {graph, ImGui::GetTextLineHeight()});
        ImGui::PopID();
        ImGui::SameLine();
        text(fmt::format("{:.2f} ms  {:.0f} %  {}", ms.back(), 100 * ms.back() / std::max(sum, 1e-6f), pass->name));
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
    pass_times(c);
    lines("Culling", c.session.measure, culling_lines(stats));
    lines("Pages", true, paging_lines(stats));
    lines("Left out", false, left_out_lines(stats));
}

}  // namespace halflight::view
