#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "engine/core/image_tools.h"
#include "engine/core/metrics.h"
#include "tools/common/color_map.h"
#include "tools/measure/common/flip.h"
#include "tools/measure/converge/conclusions.h"
#include "tools/measure/converge/maps.h"
#include "tools/measure/converge/page.h"
#include "tools/measure/converge/plot.h"
#include "tools/measure/converge/report.h"

namespace halflight::converge {
namespace {

constexpr int kThumbnail = 640;       // maximum width of a picture, pixels
constexpr std::size_t kWorst = 6;     // number of blocks that the page names
constexpr const char* kNone = "–";    // text for an unknown figure
constexpr double kEdgesMatter = 0.9;  // share of the error off the edges of lights below which it has a table

/// Returns whether all methods have the same estimator.
bool one_estimator(const Plan& plan) {
    return std::ranges::all_of(plan.techniques,
                               [&](const Technique& t) { return t.estimator == plan.techniques[0].estimator; });
}

std::string figure(double value) {
    return std::isfinite(value) ? fmt::format("{:.3g}", value) : kNone;
}

std::string percent(double share) {
    return fmt::format("{:.1f} %", 100 * share);
}

std::string signed_percent(double share) {
    return fmt::format("{:+.2f} %", 100 * share);
}

std::string known(const Interval& i) {
    return std::isnan(i.value) ? kNone : text(i);
}

Interval scaled(Interval i, double factor) {
    return {factor * i.value, factor * i.half_width};
}

std::string spaced(std::string name) {
    std::ranges::replace(name, '_', ' ');
    return name;
}

class Report {
  public:
    Report(const Subject& subject, const Reference& reference, const Measurement& measured, const ViewProcessor& view)
        : subject_(subject),
          reference_(reference),
          measured_(measured),
          view_(view),
          page_(fmt::format("Error against run time: {}", std::filesystem::path(subject.scene).filename().string())) {}

    std::string text() {
        page_.paragraph(
            fmt::format("{} × {} pixels, camera {}, {} bounces, filter {}, environment {}. {} independent pictures per "
                        "method and budget. {}{}.",
                        subject_.view.width, subject_.view.height, subject_.camera, subject_.view.bounces,
                        halflight::text(subject_.view.filter), subject_.environment, subject_.plan.seeds,
                        subject_.program, subject_.device.empty() ? "" : " on " + subject_.device),
            "sub");
        for (const std::string& bias : biases(subject_.plan)) page_.paragraph("Biased on request: " + bias);
        page_.heading("Conclusions");
        page_.begin_list();
        for (const Conclusion& c : conclusions(subject_, measured_)) page_.item(c.text, c.label, c.style);
        page_.end_list();
        methods();
        summary();
        plots();
        budgets();
        components();
        for (const MethodAgreement& a : measured_.agreements) agreement(a);
        pictures();
        conditions();
        return page_.text();
    }

  private:
    const char* clock() const { return subject_.clock == Clock::cpu ? "CPU time" : "wall time"; }
    double time_of(const Point& p) const { return by(subject_.clock, p.time); }

    void methods() {
        page_.heading("Methods");
        page_.begin_list();
        for (std::size_t m = 0; m < measured_.methods.size(); ++m)
            page_.item(explanation(subject_.plan.methods[m]), measured_.methods[m].name + ":");
        page_.end_list();
    }

    /// Returns "bias" if all offsets from the reference are biases of Halflight.
    std::string offset() const {
        return std::ranges::all_of(measured_.methods, &MethodResult::own_reference) ? "bias" : "difference";
    }

    void summary() {
        page_.heading("Efficiency");
        const bool by_variance = measured_.by_variance;
        const auto efficiency = [&](const MethodResult& m) {
            return !by_variance ? m.efficiency : m.biased ? 0 : m.efficiency_by_variance;
        };
        double best = 0;
        for (const MethodResult& m : measured_.methods) best = std::max(best, efficiency(m));
        page_.begin_table({"method", by_variance ? "efficiency by variance" : "efficiency", "MSE × s", "variance × s",
                           "paths per second", "slope", "by samples", "without worst pixels", offset() + "² / MSE",
                           offset() + " of the mean, %"},
                          fmt::format("At the largest budget, by {}. The best method has an efficiency of 1. ± marks "
                                      "{:.0f} % intervals over seeds. “Terms” below explains the columns.",
                                      clock(), 100 * kConfidence));
        for (const MethodResult& m : measured_.methods) {
            const Point& last = m.points.back();
            const bool positive = last.mse.value > 0;
            page_.row({m.name, efficiency(m) > 0 ? figure(efficiency(m) / best) : kNone,
                       figure(last.mse.value * time_of(last)), figure(last.variance.value * time_of(last)),
                       converge::text(last.paths_per_second), converge::text(m.slope),
                       converge::text(m.slope_by_samples), converge::text(m.slope_trimmed),
                       positive ? converge::text(scaled(last.bias_squared, 1 / last.mse.value)) : kNone,
                       converge::text(scaled(last.relative_bias, 100))});
        }
        page_.end_table();
        times(false);
        // Off the edges of lights, times differ only if such edges hold a part of the error.
        const auto all = error_of(by_variance, false), off_edges = error_of(by_variance, true);
        if (reference_.has_components && std::ranges::any_of(measured_.methods, [&](const MethodResult& m) {
                return (m.points.back().*off_edges).value < kEdgesMatter * (m.points.back().*all).value;
            }))
            times(true);
        terms();
    }

    void terms() {
        page_.heading("Terms", 3);
        page_.begin_list();
        const auto term = [&](const char* name, const std::string& text) { page_.item(text, std::string(name) + ":"); };
        if (measured_.by_variance)
            term("Efficiency", fmt::format("1 / (variance × seconds), because the MSE of {} also holds differences "
                                           "between the programs. –: biased on request, which variance does not show.",
                                           subject_.plan.external.name));
        else
            term("Efficiency", "1 / (MSE × seconds). Twice the efficiency means the same error in half the time.");
        term("Variance × s", fmt::format("error × seconds without the squared {}.", offset()));
        term("Slope", fmt::format("exponent of the MSE over {}; -1 for independent samples. By samples: over samples "
                                  "per pixel. Without worst pixels: without those that cause most of the error.",
                                  clock()));
        if (offset() == "bias")
            term("Bias² / MSE", "share of the error that more samples do not reduce. The bias of the mean has a sign.");
        else
            term("Difference² / MSE",
                 "share of the error that more samples do not reduce: the squared difference of the "
                 "expectation from the reference. It is a bias, or a difference between the models "
                 "of programs. The difference of the mean has a sign.");
        term("Off edges", "over the pixels that no edge of a light crosses.");
        term("Blurred MSE", fmt::format("MSE after a box blur of {0} × {0} pixels.", 2 * kBlurRadius + 1));
        term("RelMSE", fmt::format("squared errors divided by reference² + {:g}.", kRelativeEpsilon));
        term("HDR-FLIP", "visible difference, from 0 to 1.");
        term("Worst 0.1 %",
             fmt::format("share of the squared error in the worst {:g} % of the pixels.", 100 * kWorstShare));
        page_.end_list();
    }

    Plot method_plot(const std::string& title, const std::string& y_label, bool by_samples,
                     const std::function<Interval(const Point&)>& y, double guide) const {
        Plot plot{
            title, by_samples ? "samples per pixel" : fmt::format("{} per picture (s)", clock()), y_label, {}, guide};
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

    Plot components_plot(const MethodResult& m) const {
        Plot plot{fmt::format("MSE of the components, {}", m.name), "samples per pixel", "MSE", {}, -1};
        for (std::size_t c = 0; c < kComponents.size(); ++c) {
            Curve curve;
            curve.name = spaced(kComponents[c]);
            constexpr double kNoBar = std::numeric_limits<double>::infinity();
            for (const Point& p : m.points) curve.dots.push_back({p.samples, p.components[c], 0, kNoBar});
            if (std::ranges::any_of(curve.dots, [](const Dot& d) { return d.y > 0; })) plot.curves.push_back(curve);
        }
        return plot;
    }

    Plot bias_plot(const MethodResult& m) const {
        const std::string squared = fmt::format("squared {}", m.offset());
        Plot plot{fmt::format("Variance and {}, {}", squared, m.name), "samples per pixel", "part of the MSE", {}, -1};
        plot.curves = {{"variance", {}}, {squared, {}}};
        for (const Point& p : m.points) {
            const Interval &v = p.variance, &b = p.bias_squared;
            plot.curves[0].dots.push_back({p.samples, v.value, v.lower(), v.upper()});
            plot.curves[1].dots.push_back({p.samples, b.value, b.lower(), b.upper()});
        }
        return plot;
    }

    /// Adds a table of the time that each method takes to every method's final error.
    void times(bool off_edges) {
        const auto& methods = measured_.methods;
        const auto error = error_of(measured_.by_variance, off_edges);
        const auto last = [&](const MethodResult& m) { return m.points.back().*error; };
        if (methods.size() < 2 || !std::ranges::all_of(methods, [&](const auto& m) { return last(m).value > 0; }))
            return;
        Page::Cells head{"method"};
        for (const MethodResult& m : methods) head.push_back(m.name);
        page_.begin_table(
            head,
            fmt::format("Time to the same {0}{1}: how many times the {2} of the column's method the row's method needs "
                        "for the {0} that the column's method has at its largest budget. <: its first budget is better "
                        "already. –: it stays above. In brackets: {3:.0f} % intervals.",
                        measured_.by_variance ? "variance" : "MSE", off_edges ? " off the edges of lights" : "",
                        clock(), 100 * kConfidence));
        for (const MethodResult& m : methods) {
            Page::Cells cells{m.name};
            for (const MethodResult& other : methods) {
                const TimeToError time = time_to_error(m, last(other), subject_.clock, error);
                const bool at_once = (m.points.front().*error).value < last(other).value;
                const auto multiple = [&](double seconds) {
                    return std::isfinite(seconds) ? fmt::format("{:.2g}", seconds / time_of(other.points.back()))
                                                  : std::string(kNone);
                };
                cells.push_back((at_once ? "< " : "") + multiple(time.seconds));
                if (&other != &m && std::isfinite(time.seconds))
                    cells.back() += fmt::format(" ({} to {})", multiple(time.lower), multiple(time.upper));
            }
            page_.row(cells);
        }
        page_.end_table();
    }

    void plots() {
        page_.heading("Error against time");
        page_.markup("<div class=\"plots\">");
        const auto add = [&](const Plot& plot) { page_.markup(svg(plot)); };
        const auto mse = [](const Point& p) { return p.mse; };
        if (measured_.by_variance)
            add(method_plot(
                "Variance", "variance", false, [](const Point& p) { return p.variance; }, -1));
        add(method_plot("Mean squared error", "MSE", false, mse, -1));
        add(method_plot(
            "Relative mean squared error", "relMSE", false, [](const Point& p) { return p.relative_mse; }, -1));
        add(method_plot(
            "HDR-FLIP", "mean HDR-FLIP", false, [](const Point& p) { return p.flip; }, -0.5));
        add(method_plot("Mean squared error by samples", "MSE", true, mse, -1));
        for (const MethodResult* m : distinct_methods()) {
            add(bias_plot(*m));
            if (m->points.back().has_components) add(components_plot(*m));
        }
        page_.markup("</div>");
        page_.paragraph(
            fmt::format("Error bars are {0:.0f} % intervals over seeds. The estimate of the squared {1} is itself "
                        "unbiased: without {1} it is negative as often as positive, and these axes cannot show "
                        "negative values.",
                        100 * kConfidence, offset()));
    }

    /// Returns the first of each set of methods that make the same pictures.
    std::vector<const MethodResult*> distinct_methods() const {
        std::vector<const MethodResult*> methods;
        for (const auto& same : methods_of_same_pictures(measured_)) methods.push_back(same.front());
        return methods;
    }

    void budgets() {
        page_.heading("Errors and times by budget");
        page_.begin_table(
            {"pictures of", "samples", "MSE", "off edges", "blurred MSE", "relMSE", "HDR-FLIP", offset() + "²",
             "variance", "worst 0.1 %"},
            fmt::format("Errors: means over {} seeds, ± {:.0f} % intervals. MSE = {}² + variance. No figure contains "
                        "the variance of the reference. Methods that make the same pictures share their rows.",
                        subject_.plan.seeds, 100 * kConfidence, offset()));
        for (const auto& same : methods_of_same_pictures(measured_)) {
            const MethodResult& m = *same.front();
            for (std::size_t b = 0; b < m.points.size(); ++b) {
                const Point& p = m.points[b];
                page_.row({b == 0 ? names_of(same) : "", fmt::format("{:.4g}", p.samples), converge::text(p.mse),
                           known(p.off_edges_mse), converge::text(p.blurred_mse), converge::text(p.relative_mse),
                           converge::text(p.flip), converge::text(p.bias_squared), figure(p.variance.value),
                           percent(p.worst_share)},
                          b == 0 && &m != &measured_.methods.front());
            }
        }
        page_.end_table();
        Page::Cells head{"method"};
        for (const Budget& budget : subject_.plan.budgets) head.push_back(converge::text(budget));
        page_.begin_table(head, "Times of a picture: seconds of wall time / seconds of CPU time.");
        for (const MethodResult& m : measured_.methods) {
            Page::Cells cells{m.name};
            for (const Point& p : m.points) cells.push_back(figure(p.time.wall) + " / " + figure(p.time.cpu));
            page_.row(cells);
        }
        page_.end_table();
    }

    void components() {
        page_.heading("Error and time by component");
        if (!reference_.has_components) {
            page_.paragraph(
                "The reference lacks the layers of the components (emission, direct_diffuse, ...), so that errors "
                "cannot be attributed to them.");
            return;
        }
        Page::Cells head{"method"};
        for (const char* component : kComponents) head.push_back(spaced(component));
        page_.begin_table(
            head, "Share of each component in the sum of the components' squared errors at the largest budget.");
        for (const MethodResult* m : distinct_methods()) {
            if (!m->points.back().has_components) continue;
            const auto& parts = m->points.back().components;
            double sum = 0;
            for (const double part : parts) sum += std::max(part, 0.0);
            Page::Cells cells{m->name};
            for (const double part : parts) cells.push_back(sum > 0 ? percent(std::max(part, 0.0) / sum) : kNone);
            page_.row(cells);
        }
        page_.end_table();
        if (std::ranges::all_of(measured_.methods, [](const auto& m) { return m.stages.empty(); })) return;
        page_.begin_table(
            {"method", "stage", "seconds", "share of time", "share of error", "gain of twice its samples"},
            "Time of the passes of one more picture at the largest budget, each pass waited for. Camera rays are "
            "responsible for visible emission, shadow rays of the first surface for direct light, all other rays for "
            "indirect light. The gain is the factor by which the efficiency would change if this stage alone took "
            "twice the samples, ± over seeds; above 1, more time for the stage pays off.",
            true);
        for (const MethodResult& m : measured_.methods) {
            for (const Stage& s : m.stages)
                page_.row({&s == &m.stages.front() ? m.name : "", s.name, figure(s.seconds), percent(s.time_share),
                           percent(s.error_share), converge::text(s.gain)},
                          &s == &m.stages.front() && &m != &measured_.methods.front());
        }
        page_.end_table();
    }

    void agreement(const MethodAgreement& found) {
        const Agreement& a = found.agreement;
        const MethodResult& ours = measured_.methods[found.method];
        const MethodResult& theirs = measured_.methods[found.external];
        page_.heading(fmt::format("Agreement of {} with {}", theirs.name, ours.name));
        page_.paragraph(verdict_text(found, measured_.methods) + " " + reasons_text(found, measured_.methods));
        if (!a.blocks.empty()) {
            std::vector<double> sizes, errors;
            for (const Block& b : a.blocks) {
                sizes.push_back(std::abs(b.difference.relative));
                errors.push_back(b.difference.standard_error);
            }
            page_.begin_table(
                {"blocks", "median difference", "largest difference", "median standard error", "largest standard error",
                 "beyond", "expected beyond"},
                fmt::format("Blocks of {0} × {0} pixels at the largest budget, {1} seeds. A block is beyond "
                            "where its difference exceeds {2:g} % and its standard error; the last column "
                            "is the number that noise alone would put there.",
                            a.side, subject_.plan.seeds, 100 * a.tolerance));
            page_.row({std::to_string(a.blocks.size()), percent(median(sizes)), percent(quantile(sizes, 1)),
                       percent(median(errors)), percent(quantile(errors, 1)), std::to_string(a.beyond),
                       figure(a.expected_beyond)});
            page_.end_table();
            std::vector<Block> worst = a.blocks;
            std::ranges::sort(worst, std::ranges::greater(),
                              [](const Block& b) { return std::abs(b.difference.relative); });
            std::string list;
            for (std::size_t i = 0; i < std::min(kWorst, worst.size()); ++i)
                list +=
                    fmt::format("{}({}, {}): {} ± {:.2f} %", i ? "; " : "", worst[i].x, worst[i].y,
                                signed_percent(worst[i].difference.relative), 100 * worst[i].difference.standard_error);
            page_.paragraph("Largest differences by upper left pixel, ± one standard error: " + list + ".");
        }
        const double scale = 2 * kBlockTolerance;
        page_.begin_figures();
        page_.figure(view_.apply(shrink(ours.mean, kThumbnail)), "Mean of all seeds: " + ours.name);
        page_.figure(view_.apply(shrink(theirs.mean, kThumbnail)), "Mean of all seeds: " + theirs.name);
        const std::string key = fmt::format("red where {} is brighter, blue where it is darker, full colour at ±{:g} %",
                                            theirs.name, 100 * scale);
        page_.figure(shrink(relative_difference_picture(ours.mean, theirs.mean, scale), kThumbnail),
                     "Difference by pixel: " + key);
        page_.figure(shrink(block_difference_picture(a, ours.mean.width, ours.mean.height, scale), kThumbnail),
                     "Difference by block: " + key);
        page_.end_figures();
    }

    void pictures() {
        page_.heading("Pictures");
        const Image reference = shrink(reference_.mean.beauty, kThumbnail);
        page_.begin_figures();
        page_.figure(view_.apply(reference), fmt::format("Reference: {}", name_of(reference_)));
        page_.end_figures();
        for (const MethodResult* m : distinct_methods()) {
            const Image picture = shrink(m->picture, kThumbnail), mean = shrink(m->mean, kThumbnail);
            const double scale = error_scale(picture, reference), mean_scale = error_scale(mean, reference);
            const Image flip = hdr_flip_map(m->picture, reference_.mean.beauty);
            page_.heading(fmt::format("{}, {}", m->name, converge::text(subject_.plan.budgets.back())), 3);
            page_.begin_figures();
            page_.figure(view_.apply(picture), "First seed");
            page_.figure(
                signed_error_picture(picture, reference, scale),
                fmt::format("Error of the first seed: red is too bright, blue too dark, full colour at ±{:.2g}",
                            scale));
            page_.figure(
                magma(shrink(flip, kThumbnail), 1),
                fmt::format("HDR-FLIP of the first seed, 0 (black) to 1 (light yellow), mean {:.3f}", mean_of(flip)));
            page_.figure(signed_error_picture(mean, reference, mean_scale),
                         fmt::format("Error of the mean of all seeds, full colour at ±{:.2g}; structure in it is {}",
                                     mean_scale, m->own_reference ? "bias" : "difference from the reference"));
            page_.end_figures();
        }
    }

    void conditions() {
        page_.heading("Method of measurement");
        page_.begin_list();
        page_.item(fmt::format("The reference is made by {}, because {}.", name_of(reference_), reference_.reason));
        if (reference_.samples > 0)
            page_.item(fmt::format(
                "The reference has {} samples per pixel in two independent halves; {} of them come "
                "from earlier runs. Squared errors are means of (x - half 1)(x - half 2), which do "
                "not contain the reference's variance, {:.2g}.",
                reference_.samples, reference_.found, measured_.methods.front().points.front().reference_variance));
        page_.item(
            "Times are those of the samples, down to the picture in memory. Loading, scene preparation and shader "
            "compilation happen once beforehand and do not count.");
        if (subject_.scene_seconds > 0)
            page_.item(fmt::format("Scene preparation for the GPU, once for all methods{}, took {:.2f} s of wall time.",
                                   one_estimator(subject_.plan) ? "" : " with the same estimator",
                                   subject_.scene_seconds));
        for (const std::string& pilot : subject_.pilots) page_.item(pilot);
        const External& external = subject_.plan.external;
        if (!external.name.empty()) page_.item(fmt::format("{} is the command: {}", external.name, external.command));
        for (std::size_t m = 0; m < measured_.methods.size(); ++m) {
            const MethodResult& method = measured_.methods[m];
            if (subject_.plan.methods[m] == Method::external)
                page_.item(
                    fmt::format("Times of {} are those that it prints, otherwise those of its whole process, "
                                "which contain its start and end and count most in small budgets.",
                                method.name));
            else
                page_.item(fmt::format("Preparation of {} took {:.2f} s of wall time, {:.2f} s of CPU time.",
                                       method.name, method.preparation.wall, method.preparation.cpu));
        }
        if (measured_.pictures_compared > 0)
            page_.item(
                fmt::format("Of {} pictures compared with another method's of the same seed and samples, {} "
                            "differ.",
                            measured_.pictures_compared, measured_.pictures_different));
        page_.item(
            "Slopes are least-squares fits, weighted by the scatter over seeds. Their intervals are wider where the "
            "points lie off the line by more than that scatter.");
        page_.end_list();
    }

    const Subject& subject_;
    const Reference& reference_;
    const Measurement& measured_;
    const ViewProcessor& view_;
    Page page_;
};

}  // namespace

std::string report_html(const Subject& subject, const Reference& reference, const Measurement& measured,
                        const ViewProcessor& view) {
    return Report(subject, reference, measured, view).text();
}

}  // namespace halflight::converge
