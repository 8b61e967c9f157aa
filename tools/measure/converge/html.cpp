#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "engine/core/image_tools.h"
#include "engine/core/metrics.h"
#include "tools/common/color_map.h"
#include "tools/measure/common/flip.h"
#include "tools/measure/converge/maps.h"
#include "tools/measure/converge/plot.h"
#include "tools/measure/converge/report.h"

namespace halflight::converge {
namespace {

constexpr int kThumbnail = 640;  // pixels at most

constexpr const char* kStyle = R"css(
:root { color-scheme: light }
body { background: #fff; color: #222; font: 15px/1.5 Helvetica, Arial, sans-serif; max-width: 1160px;
  margin: 32px auto; padding: 0 24px }
h1 { font-size: 26px; margin: 0 0 4px } h2 { font-size: 19px; margin: 36px 0 10px } h3 { font-size: 15px; margin: 22px 0 6px }
p { max-width: 80ch; margin: 8px 0 } .sub { color: #666; margin: 0 0 18px }
table { border-collapse: collapse; font-size: 12.5px; font-variant-numeric: tabular-nums; margin: 8px 0 }
th { text-align: right; font-weight: 600; border-bottom: 1.5px solid #222; padding: 4px 6px; vertical-align: bottom }
td { text-align: right; border-bottom: 1px solid #e4e4e4; padding: 4px 6px; white-space: nowrap }
th:first-child, td:first-child { text-align: left; padding-left: 2px } .names :is(th, td):nth-child(2) { text-align: left }
tr.first td { border-top: 1.5px solid #999 }
caption { caption-side: bottom; text-align: left; color: #666; font-size: 12.5px; padding: 6px 2px; max-width: 95ch }
.fine { color: #00724f; font-weight: 600 } .open { color: #666; font-weight: 600 } .flag { color: #b3400a; font-weight: 600 }
.plots { display: grid; grid-template-columns: 1fr 1fr; gap: 18px 26px } .plots svg { width: 100%; height: auto }
.pictures { display: grid; grid-template-columns: repeat(auto-fill, minmax(255px, 1fr)); gap: 16px 18px }
figure { margin: 0 } figcaption { font-size: 12.5px; color: #444; margin-top: 4px }
figure img { width: 100%; height: auto; display: block; border: 1px solid #ddd; image-rendering: pixelated }
ul { padding-left: 20px; max-width: 85ch } li { margin: 4px 0 }
@media print { body { margin: 0; max-width: none; font-size: 11pt } h2 { break-after: avoid }
  table, figure, .plots svg { break-inside: avoid } }
@media (max-width: 800px) { .plots { grid-template-columns: 1fr } table { display: block; overflow-x: auto } }
)css";

std::string figure(double value) {
    return std::isfinite(value) ? fmt::format("{:.3g}", value) : "–";
}

std::string percent(double share) {
    return fmt::format("{:.1f} %", 100 * share);
}

Interval in_percent(Interval i) {
    i.value *= 100, i.half_width *= 100;
    return i;
}

/// With true minus signs before figures, and no line broken before a per cent sign.
std::string typeset(const std::string& text) {
    std::string out;
    for (std::size_t i = 0; i < text.size(); ++i) {
        const char before = i > 0 ? text[i - 1] : ' ', after = i + 1 < text.size() ? text[i + 1] : ' ';
        if (text[i] == '-' && (before == '(' || before == ' ') && after >= '0' && after <= '9')
            out += "−";
        else if (text[i] == ' ' && after == '%')
            out += "\u00a0";
        else
            out += text[i];
    }
    return out;
}

/// How a finding looks: what is wrong, what is better than expected, what is not known.
const char* style_of(Finding::Kind kind) {
    using enum Finding::Kind;
    return kind == faster ? "fine" : kind == inconclusive || kind == noisy_reference ? "open" : "flag";
}

/// Its caller escapes nothing: all text goes through escape() here, but for what is called markup.
class Page {
  public:
    Page(const Subject& subject, const Reference& reference, const Measurement& measured, const ViewProcessor& view)
        : subject_(subject), reference_(reference), measured_(measured), view_(view) {}

    std::string text() {
        const std::string scene = std::filesystem::path(subject_.scene).filename().string();
        out_ = fmt::format(
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n<meta name=\"viewport\" "
            "content=\"width=device-width, initial-scale=1\"/>\n<title>Error against run time: {0}</title>\n"
            "<style>{1}</style>\n</head>\n<body>\n<h1>Error against run time: {0}</h1>\n",
            escape(scene), kStyle);
        paragraph(
            fmt::format(
                "{} × {} pixels, camera {}, {} bounces, filter {}, environment {}; {} independent pictures of each "
                "budget; {}{}.",
                subject_.view.width, subject_.view.height, subject_.camera, subject_.view.bounces,
                halflight::text(subject_.view.filter), subject_.environment, subject_.plan.seeds, subject_.program,
                subject_.device.empty() ? "" : " on " + subject_.device),
            "sub");
        for (const std::string& bias : biases(subject_.plan)) paragraph("Biased on purpose: " + bias);
        summary();
        plots();
        budgets();
        components();
        pictures();
        conditions();
        return out_ + "</body>\n</html>\n";
    }

  private:
    using Cells = std::vector<std::string>;

    void markup(const std::string& text) { out_ += text + '\n'; }
    void heading(const char* text, int level = 2) { markup(fmt::format("<h{0}>{1}</h{0}>", level, escape(text))); }
    void paragraph(const std::string& text, const char* style = "") {
        markup(fmt::format("<p class=\"{}\">{}</p>", style, escape(typeset(text))));
    }
    void list(const std::vector<std::string>& items) {
        if (items.empty()) return;
        markup("<ul>");
        for (const std::string& item : items) markup(fmt::format("<li>{}</li>", escape(typeset(item))));
        markup("</ul>");
    }
    /// `style`: "names" where the second column holds words.
    void begin_table(const Cells& head, const std::string& caption, const char* style = "") {
        markup(fmt::format("<table class=\"{}\">", style));
        markup(fmt::format("<caption>{}</caption>", escape(typeset(caption))));
        std::string row;
        for (const std::string& cell : head) row += fmt::format("<th>{}</th>", escape(cell));
        markup(fmt::format("<thead><tr>{}</tr></thead>\n<tbody>", row));
    }
    void row(const Cells& cells, const char* style = "") {
        std::string text;
        for (const std::string& cell : cells) text += fmt::format("<td>{}</td>", escape(typeset(cell)));
        markup(fmt::format("<tr class=\"{}\">{}</tr>", style, text));
    }
    void end_table() { markup("</tbody></table>"); }

    const char* clock() const { return subject_.clock == Clock::cpu ? "CPU time" : "wall time"; }
    double time_of(const Point& p) const { return subject_.clock == Clock::cpu ? p.time.cpu : p.time.wall; }

    void summary() {
        double best = 0;
        for (const MethodResult& m : measured_.methods) best = std::max(best, m.efficiency);
        begin_table(
            {"method", "slope of MSE", "slope by samples", "without worst 0.1 %", "bias², of MSE",
             "bias of the mean, %", "efficiency"},
            fmt::format("Slopes of log MSE against log {}; -1 is that of independent samples. Bias at the "
                        "largest budget, where it shows best: squared, as a share of the MSE, and signed, of the "
                        "picture's mean. Efficiency, 1 / (MSE × seconds), is relative to the best method. ± are "
                        "{:.0f} % intervals.",
                        clock(), 100 * kConfidence));
        for (const MethodResult& m : measured_.methods) {
            const Point& last = m.points.back();
            Interval share = last.bias_squared;
            share.value /= last.mse.value, share.half_width /= last.mse.value;
            const bool told = last.mse.value > 0;
            row({m.name, converge::text(m.slope), converge::text(m.slope_by_samples), converge::text(m.slope_trimmed),
                 told ? converge::text(share) : "–", converge::text(in_percent(last.relative_bias)),
                 told && best > 0 ? figure(m.efficiency / best) : "–"});
        }
        end_table();
        times(false);
        if (reference_.has_components) times(true);
        markup("<ul>");
        for (const MethodResult& m : measured_.methods) {
            if (m.findings.empty())
                markup(
                    fmt::format("<li>{}: <span class=\"fine\">nothing to note</span> (unbiased within its interval, "
                                "slope −1 within 0.1 or within its interval).</li>",
                                escape(m.name)));
            for (const Finding& f : m.findings)
                markup(fmt::format("<li>{}: <span class=\"{}\">{}.</span> {}</li>", escape(m.name), style_of(f.kind),
                                   escape(std::string(name(f.kind))), escape(typeset(f.text))));
        }
        for (const std::string& line : advice(subject_, measured_))
            markup(fmt::format("<li>{}</li>", escape(typeset(line))));
        markup("</ul>");
    }

    Plot method_plot(const std::string& title, const std::string& y_label, bool by_samples,
                     const std::function<Interval(const Point&)>& y, double guide) const {
        Plot plot{
            title, by_samples ? "samples per pixel" : fmt::format("{} of a picture (s)", clock()), y_label, {}, guide};
        for (const MethodResult& m : measured_.methods) {
            Curve& curve = plot.curves.emplace_back();
            curve.name = m.name;
            for (const Point& p : m.points) {
                const Interval i = y(p);
                curve.dots.push_back({by_samples ? p.samples : time_of(p), i.value, i.lower(), i.upper()});
            }
        }
        return plot;
    }

    /// Parts of one method's MSE by samples.
    Plot parts_plot(const MethodResult& m) const {
        Plot plot{fmt::format("MSE of the components, {}", m.name), "samples per pixel", "MSE", {}, -1};
        for (std::size_t c = 0; c < kComponents.size(); ++c) {
            Curve curve;
            curve.name = kComponents[c];
            std::ranges::replace(curve.name, '_', ' ');
            constexpr double kNone = std::numeric_limits<double>::infinity();
            for (const Point& p : m.points) curve.dots.push_back({p.samples, p.components[c], 0, kNone});
            if (std::ranges::any_of(curve.dots, [](const Dot& d) { return d.y > 0; })) plot.curves.push_back(curve);
        }
        return plot;
    }

    Plot bias_plot(const MethodResult& m) const {
        Plot plot{fmt::format("Variance and squared bias, {}", m.name), "samples per pixel", "part of the MSE", {}, -1};
        plot.curves = {{"variance", {}}, {"squared bias", {}}};
        for (const Point& p : m.points) {
            const Interval &v = p.variance, &b = p.bias_squared;
            plot.curves[0].dots.push_back({p.samples, v.value, v.lower(), v.upper()});
            plot.curves[1].dots.push_back({p.samples, b.value, b.lower(), b.upper()});
        }
        return plot;
    }

    static std::string known(const Interval& i) { return std::isnan(i.value) ? "–" : converge::text(i); }

    /// How long each method takes to the error of each other one's largest budget, as a part of that one's time.
    void times(bool off_edges) {
        const auto& methods = measured_.methods;
        const auto last = [&](const MethodResult& m) {
            const Point& p = m.points.back();
            return (off_edges ? p.off_edges_mse : p.mse).value;
        };
        if (methods.size() < 2 || !std::ranges::all_of(methods, [&](const auto& m) { return last(m) > 0; })) return;
        Cells head{"method"};
        for (const MethodResult& m : methods) head.push_back(m.name);
        begin_table(
            head,
            fmt::format("Time to the same error{}: by how many times as much {} a row's method comes to the MSE of a "
                        "column's largest budget, as its own line between budgets has it. < where its first budget "
                        "is below that already, – where its last one is above.",
                        off_edges ? " off the edges of lights" : "", clock()));
        for (const MethodResult& m : methods) {
            Cells cells{m.name};
            for (const MethodResult& other : methods) {
                const double seconds = seconds_until(m, last(other), subject_.clock, off_edges);
                const Point& first = m.points.front();
                const bool at_once = (off_edges ? first.off_edges_mse : first.mse).value < last(other);
                cells.push_back(std::isfinite(seconds) ? fmt::format("{}{:.2g}", at_once ? "< " : "",
                                                                     seconds / time_of(other.points.back()))
                                                       : "–");
            }
            row(cells);
        }
        end_table();
    }

    void plots() {
        heading("Error against time");
        markup("<div class=\"plots\">");
        markup(svg(method_plot(
            "Mean squared error", "MSE", false, [](const Point& p) { return p.mse; }, -1)));
        markup(svg(method_plot(
            "Relative mean squared error", "relMSE", false, [](const Point& p) { return p.relative_mse; }, -1)));
        markup(svg(method_plot(
            "HDR-FLIP", "mean HDR-FLIP", false, [](const Point& p) { return p.flip; }, -0.5)));
        markup(svg(method_plot(
            "Mean squared error by samples", "MSE", true, [](const Point& p) { return p.mse; }, -1)));
        for (const MethodResult* m : distinct_methods()) {
            markup(svg(bias_plot(*m)));
            if (m->points.back().has_components) markup(svg(parts_plot(*m)));
        }
        markup("</div>");
        paragraph(
            "Error bars: 95 % intervals over seeds. A squared bias is estimated without bias itself: where there is "
            "none it is as often below zero, which these axes cannot show, as above.");
    }

    /// The first of those that make the same pictures.
    std::vector<const MethodResult*> distinct_methods() const {
        std::vector<const MethodResult*> methods;
        for (const MethodResult& m : measured_.methods) {
            const auto same = [&](const MethodResult* other) { return same_bits(other->mean, m.mean); };
            if (std::ranges::none_of(methods, same)) methods.push_back(&m);
        }
        return methods;
    }

    void budgets() {
        heading("By budget");
        begin_table(
            {"method", "samples", "wall s", "CPU s", "MSE", "off edges", "blurred MSE", "relMSE", "HDR-FLIP", "bias²",
             "variance", "worst 0.1 %"},
            fmt::format("Means over {} seeds ± {:.0f} % intervals. off edges: MSE without what pixels on the edges of "
                        "lights add. blurred MSE: after a blur of {} × {} pixels. "
                        "relMSE: squared error by reference² + {:g}. "
                        "MSE = bias² + variance, all without the variance of the reference. Worst 0.1 %: share of "
                        "the squared error that the worst {:g} % of the pixels hold.",
                        subject_.plan.seeds, 100 * kConfidence, 2 * kBlurRadius + 1, 2 * kBlurRadius + 1,
                        kRelativeEpsilon, 100 * kWorstShare));
        for (const MethodResult& m : measured_.methods) {
            for (std::size_t b = 0; b < m.points.size(); ++b) {
                const Point& p = m.points[b];
                row({b == 0 ? m.name : "", fmt::format("{:.4g}", p.samples), figure(p.time.wall), figure(p.time.cpu),
                     converge::text(p.mse), known(p.off_edges_mse), converge::text(p.blurred_mse),
                     converge::text(p.relative_mse), converge::text(p.flip), converge::text(p.bias_squared),
                     figure(p.variance.value), percent(p.worst_share)},
                    b == 0 && &m != &measured_.methods.front() ? "first" : "");
            }
        }
        end_table();
    }

    void components() {
        heading("Where the error and the time are");
        if (!reference_.has_components) {
            paragraph(
                "The reference has no components (layers emission, direct_diffuse, ...), so that errors cannot be "
                "told apart by them.");
            return;
        }
        Cells head{"method"};
        for (const char* component : kComponents) {
            head.emplace_back(component);
            std::ranges::replace(head.back(), '_', ' ');
        }
        begin_table(head,
                    "Share of each component in the sum of the components' squared errors, at the largest budget.");
        for (const MethodResult* m : distinct_methods()) {
            if (!m->points.back().has_components) continue;
            const auto& parts = m->points.back().components;
            double sum = 0;
            for (const double part : parts) sum += std::max(part, 0.0);
            Cells cells{m->name};
            for (const double part : parts) cells.push_back(sum > 0 ? percent(std::max(part, 0.0) / sum) : "–");
            row(cells);
        }
        end_table();
        if (std::ranges::all_of(measured_.methods, [](const auto& m) { return m.stages.empty(); })) return;
        begin_table(
            {"method", "stage", "seconds", "share of time", "share of error", "gain of twice its samples"},
            "Time by passes, each waited for, of one more picture of the largest budget. Camera rays answer for "
            "the emission that is seen, shadow rays of the first surface for direct light, all other rays for "
            "indirect light, though these meet lights, too. Gain: of the efficiency, if the samples of this stage "
            "alone were doubled, ± over seeds; above 1, the next second is well spent on it.",
            "names");
        for (const MethodResult& m : measured_.methods) {
            for (const Stage& s : m.stages)
                row({&s == &m.stages.front() ? m.name : "", s.name, figure(s.seconds), percent(s.time_share),
                     percent(s.error_share), converge::text(s.gain)},
                    &s == &m.stages.front() && &m != &measured_.methods.front() ? "first" : "");
        }
        end_table();
    }

    void show(const Image& display_encoded, const std::string& caption) {
        markup(fmt::format(
            "<figure><img src=\"{}\" width=\"{}\" height=\"{}\" alt=\"{}\"/><figcaption>{}</figcaption></figure>",
            data_uri(display_encoded), display_encoded.width, display_encoded.height, escape(caption),
            escape(caption)));
    }

    void pictures() {
        heading("Pictures");
        const Image reference = shrink(reference_.mean.beauty, kThumbnail);
        const std::string budget = converge::text(subject_.plan.budgets.back());
        markup("<div class=\"pictures\">");
        show(view_.apply(reference), fmt::format("Reference: {}", reference_.maker));
        markup("</div>");
        for (const MethodResult* m : distinct_methods()) {
            const Image picture = shrink(m->picture, kThumbnail), mean = shrink(m->mean, kThumbnail);
            const double scale = error_scale(picture, reference), mean_scale = error_scale(mean, reference);
            const Image flip = hdr_flip_map(m->picture, reference_.mean.beauty);
            heading(fmt::format("{}, {}", m->name, budget).c_str(), 3);
            markup("<div class=\"pictures\">");
            show(view_.apply(picture), "first seed");
            show(signed_error_picture(picture, reference, scale),
                 fmt::format("its error: red brighter, blue darker, full colour at ±{:.2g}", scale));
            show(magma(shrink(flip, kThumbnail), 1),
                 fmt::format("its HDR-FLIP, from 0 (black) to 1 (light yellow), mean {:.3f}", mean_of(flip)));
            show(signed_error_picture(mean, reference, mean_scale),
                 fmt::format("error of the mean of all seeds, full colour at ±{:.2g}: what is no noise in it is bias",
                             mean_scale));
            markup("</div>");
        }
    }

    void conditions() {
        heading("How this was measured");
        std::vector<std::string> lines;
        lines.push_back(fmt::format("Reference: {}, because {}.", reference_.maker, reference_.reason));
        if (reference_.samples > 0)
            lines.push_back(fmt::format(
                "It has {} samples per pixel in two independent halves, {} of them kept from "
                "earlier runs. Errors are means of (x - half 1)(x - half 2), so that its own "
                "variance, {:.2g}, is not in them.",
                reference_.samples, reference_.found, measured_.methods.front().points.front().reference_variance));
        lines.push_back(
            "Times are those of the samples, down to the picture in memory. Loading, preparing the scene and "
            "compiling shaders are done once, beforehand, and do not count: the fits are of run time without "
            "set-up.");
        if (subject_.scene_seconds > 0)
            lines.push_back(fmt::format("Preparing the scene for the GPU, once for all methods{}: {:.2f} s wall time.",
                                        subject_.plan.estimators.empty() ? "" : " of an estimator",
                                        subject_.scene_seconds));
        lines.insert(lines.end(), subject_.pilots.begin(), subject_.pilots.end());
        if (!subject_.plan.external.name.empty())
            lines.push_back(
                fmt::format("{} is the command: {}", subject_.plan.external.name, subject_.plan.external.command));
        for (std::size_t m = 0; m < measured_.methods.size(); ++m) {
            const MethodResult& method = measured_.methods[m];
            if (subject_.plan.methods[m] == Method::external)
                lines.push_back(fmt::format(
                    "Times of {} are what it tells of itself, or those of its whole process: what it does before and "
                    "after its samples may be in them, and counts most in small budgets.",
                    method.name));
            else
                lines.push_back(fmt::format("Preparation for {}: {:.2f} s wall time, {:.2f} s CPU time.", method.name,
                                            method.preparation.wall, method.preparation.cpu));
        }
        lines.push_back(
            "Methods take turns, in another order each time, so that what else the machine does falls on all "
            "alike. Each budget and each repeat has a seed of its own, the same one for all methods.");
        if (measured_.pictures_compared > 0)
            lines.push_back(
                fmt::format("Pictures of the same seed by different ways of tracing: {} compared, {} differ.",
                            measured_.pictures_compared, measured_.pictures_different));
        lines.push_back(
            "Slopes are fitted by least squares, weighted by the scatter over seeds, widened where the points "
            "lie off the line by more than that scatter.");
        list(lines);
    }

    const Subject& subject_;
    const Reference& reference_;
    const Measurement& measured_;
    const ViewProcessor& view_;
    std::string out_;
};

}  // namespace

std::string report_html(const Subject& subject, const Reference& reference, const Measurement& measured,
                        const ViewProcessor& view) {
    return Page(subject, reference, measured, view).text();
}

}  // namespace halflight::converge
