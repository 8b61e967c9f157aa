#include "tools/measure/converge/report.h"
#include "tools/measure/converge/conclusions.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <nlohmann/json.hpp>

#include "engine/core/metrics.h"
#include "tools/measure/converge/conclusions.h"

namespace halflight::converge {
namespace {

using Json = nlohmann::ordered_json;

Json number(double value) {
    return std::isfinite(value) ? Json(value) : Json(nullptr);
}

Json interval_json(const Interval& i) {
    return {{"value", number(i.value)}, {"half_width", number(i.half_width)}};
}

Json seconds_json(const Seconds& s) {
    return {{"wall", s.wall}, {"cpu", s.cpu}};
}

Json slope_json(const Slope& s) {
    const Json slope = is_known(s) ? interval_json(s.slope) : Json{{"value", nullptr}, {"half_width", nullptr}};
    return {{"slope", slope}, {"scatter", number(s.scatter)}, {"points", s.points}};
}

Json components_json(bool known, const std::array<double, kComponents.size()>& values) {
    if (!known) return nullptr;
    Json json;
    for (std::size_t c = 0; c < kComponents.size(); ++c) json[kComponents[c]] = values[c];
    return json;
}

Json budget_json(const Budget& b) {
    return b.seconds > 0 ? Json{{"seconds", b.seconds}} : Json{{"samples", b.samples}};
}

Json run_json(const Subject& subject, const RunResult& r) {
    return {{"method", subject.plan.method_name(static_cast<std::size_t>(r.run.method))},
            {"budget", budget_json(subject.plan.budgets[static_cast<std::size_t>(r.run.budget)])},
            {"seed", r.run.seed},
            {"samples", r.samples},
            {"seconds", seconds_json(r.time)},
            {"mse", r.mse},
            {"relative_mse", r.relative_mse},
            {"blurred_mse", r.blurred_mse},
            {"hdr_flip", r.errors.flip},
            {"trimmed_mse", r.errors.trimmed_mse},
            {"components_mse", components_json(r.errors.has_components, r.errors.components)},
            {"non_finite", r.non_finite}};
}

/// offset: MethodResult::offset()
Json point_json(const Budget& budget, const Point& p, const std::string& offset) {
    return {{"budget", budget_json(budget)},
            {"samples", p.samples},
            {"seconds", seconds_json(p.time)},
            {"paths_per_second", interval_json(p.paths_per_second)},
            {"mse", interval_json(p.mse)},
            {"relative_mse", interval_json(p.relative_mse)},
            {"blurred_mse", interval_json(p.blurred_mse)},
            {"off_edges_mse", interval_json(p.off_edges_mse)},
            {"hdr_flip", interval_json(p.flip)},
            {offset + "_squared", interval_json(p.bias_squared)},
            {"variance", interval_json(p.variance)},
            {"off_edges_variance", interval_json(p.off_edges_variance)},
            {"relative_" + offset, interval_json(p.relative_bias)},
            {"reference_variance", p.reference_variance},
            {"trimmed_mse", p.trimmed_mse},
            {"worst_share", p.worst_share},
            {"components_mse", components_json(p.has_components, p.components)}};
}

Json method_json(const Subject& subject, const Measurement& measured, const MethodResult& m) {
    Json points = Json::array(), passes = Json::array(), stages = Json::array(), findings = Json::array();
    for (std::size_t b = 0; b < m.points.size(); ++b)
        points.push_back(point_json(subject.plan.budgets[b], m.points[b], m.offset()));
    for (const PassTime& pass : m.passes)
        passes.push_back({{"name", pass.name}, {"runs", pass.runs}, {"seconds", pass.seconds}});
    for (const Stage& s : m.stages)
        stages.push_back({{"name", s.name},
                          {"seconds", s.seconds},
                          {"time_share", s.time_share},
                          {"error_share", s.error_share},
                          {"gain_of_twice_the_samples", interval_json(s.gain)}});
    Json to_error = Json::object();  // time to the error at the largest budget
    for (const MethodResult& other : measured.methods) {
        const auto add = [&](const std::string& key, Interval Point::*error) {
            TimeToError time = time_to_error(m, other.points.back().*error, subject.clock, error);
            if (&other == &m) time.lower = time.upper = time.seconds;  // its own error at that budget
            to_error[other.name][key] = number(time.seconds);
            to_error[other.name][key + "_interval"] = {number(time.lower), number(time.upper)};
        };
        add("mse", &Point::mse);
        add("off_edges_mse", &Point::off_edges_mse);
        add("variance", &Point::variance);
        add("off_edges_variance", &Point::off_edges_variance);
    }
    for (const Finding& f : m.findings) findings.push_back({{"kind", name(f.kind)}, {"text", f.text}});
    return {{"method", m.name},
            {"preparation_seconds", seconds_json(m.preparation)},
            {"slope", slope_json(m.slope)},
            {"slope_by_samples", slope_json(m.slope_by_samples)},
            {"slope_trimmed", slope_json(m.slope_trimmed)},
            {"efficiency", number(m.efficiency)},
            {"efficiency_by_variance", number(m.efficiency_by_variance)},
            {"seconds_to_the_error_of", to_error},
            {"points", points},
            {"passes", passes},
            {"stages", stages},
            {"lead_of_the_best_stage", stages.empty() ? Json() : interval_json(m.stage_lead)},
            {"findings", findings}};
}

Json agreement_json(const Measurement& measured, const MethodAgreement& found) {
    const Agreement& a = found.agreement;
    Json blocks = Json::array();
    for (const Block& b : a.blocks)
        blocks.push_back({{"x", b.x},
                          {"y", b.y},
                          {"difference", b.difference.relative},
                          {"standard_error", b.difference.standard_error},
                          {"beyond", b.beyond},
                          {"chance_of_beyond", b.chance_of_beyond},
                          {"chance", b.chance}});
    const Point& theirs = measured.methods[found.external].points.back();
    const double mse = theirs.mse.value;
    return {{"method", measured.methods[found.method].name},
            {"other", measured.methods[found.external].name},
            {"verdict", name(a.verdict())},
            {"agrees", a.verdict() == Verdict::agree},
            {"difference", number(a.whole.relative)},
            {"standard_error", number(a.whole.standard_error)},
            {"half_width", number(a.whole.interval().half_width)},
            {"chance", number(a.whole.chance())},
            {"tolerance", kWholeTolerance},
            {"squared_difference_share", number(mse > 0 ? theirs.bias_squared.value / mse : NAN)},
            {"variance_share", number(mse > 0 ? theirs.variance.value / mse : NAN)},
            {"block_side", a.side},
            {"block_tolerance", a.tolerance},
            {"blocks_beyond", a.beyond},
            {"blocks_beyond_by_noise", a.expected_beyond},
            {"chance_of_blocks_beyond", a.chance_of_beyond},
            {"chance_of_blocks", a.chance_of_blocks},
            {"chance_of_worst_block", a.chance_of_worst},
            {"blocks", blocks}};
}

/// Returns the factor between the efficiencies of two methods, with the noise of errors and times.
Interval factor_between(const MethodResult& a, const MethodResult& b, double value, const Interval Point::*error) {
    double squares = 0;
    const auto add = [&](const Interval& i) {
        if (i.value > 0) squares += i.half_width / i.value * (i.half_width / i.value);
    };
    const Point &first = a.points.back(), &second = b.points.back();
    if ((first.*error).value != (second.*error).value)  // equal errors are those of the same pictures
        add(first.*error), add(second.*error);
    add(first.paths_per_second), add(second.paths_per_second);
    return {value, value * std::sqrt(squares)};
}

/// Returns which of several methods is the most efficient, and by what factor: by mse, or by variance. Methods whose
/// factor may be 1 are not told apart.
std::string ranking(const Subject& subject, const std::vector<const MethodResult*>& methods, bool by_variance) {
    const auto error = error_of(by_variance, false);
    const auto efficiency = [&](const MethodResult* m) {
        return by_variance ? m->efficiency_by_variance : m->efficiency;
    };
    const auto [worst, best] = std::ranges::minmax_element(methods, {}, efficiency);
    if (efficiency(*worst) <= 0)
        return "Which method lowers the error most per second is not known, because the error of one of them is within "
               "the noise of the reference. A reference with more samples would tell.";
    std::string others, alike;
    for (const MethodResult* m : methods) {
        if (m == *best) continue;
        const Interval factor = factor_between(**best, *m, efficiency(*best) / efficiency(m), error);
        std::string& list = std::isfinite(factor.half_width) && factor.lower() <= 1 ? alike : others;
        list += fmt::format("{}{} times that of {}", list.empty() ? "" : ", ",
                            factor.half_width > 0 ? text(factor) : fmt::format("{:.2f}", factor.value), m->name);
    }
    const char* const what = by_variance ? "variance" : "MSE";
    std::string line;
    if (!others.empty())
        line = fmt::format(
            "{} lowers the {} most per second of {} time. Its efficiency, 1 / ({} × s) at the largest budget, is {}.",
            (*best)->name, by_variance ? "variance" : "error", subject.clock == Clock::cpu ? "CPU" : "wall", what,
            others);
    if (!alike.empty())
        line += fmt::format(
            "{}No difference shows in efficiency, 1 / ({} × s) at the largest budget: that of {} is {}, within the "
            "noise.",
            line.empty() ? "" : " ", what, (*best)->name, alike);
    return line;
}

/// Returns advice on the stage whose samples lower a method's error most, as far as its seeds show it.
std::string stage_advice(const MethodResult& m) {
    std::vector<const Stage*> order;
    for (const Stage& stage : m.stages) order.push_back(&stage);
    std::ranges::sort(order, std::ranges::greater(), [](const Stage* s) { return s->gain.value; });
    const Stage& s = *order.front();
    const std::string which = fmt::format("{}, with {:.0f} % of the error and {:.0f} % of the time", s.name,
                                          100 * s.error_share, 100 * s.time_share);
    if (s.gain.upper() <= 1)
        return fmt::format("more time for a single stage does not pay off. The best one is {}.", which);
    if ((order.size() < 2 || m.stage_lead.lower() > 0) && s.gain.lower() > 1)
        return fmt::format(
            "more time pays off most for {}. Twice the samples for this stage alone would multiply the efficiency by "
            "{}.",
            which, text(s.gain));
    std::string others;
    for (std::size_t i = 1; i < order.size(); ++i)
        others += fmt::format(", for {} by {}", order[i]->name, text(order[i]->gain));
    return fmt::format(
        "undecided, because the seeds do not show for which stage more time pays off most. Twice the samples for {}, "
        "would multiply the efficiency by {}{}.",
        which, text(s.gain), others);
}

}  // namespace

std::vector<std::string> biases(const Plan& plan) {
    std::vector<std::string> all;
    if (plan.clamp > 0)
        all.push_back(
            fmt::format("Indirect light of the GL methods is clamped to a luminance of {:g} per sample, that of the "
                        "reference is not.",
                        plan.clamp));
    for (std::size_t m = 0; m < plan.methods.size(); ++m) {
        if (plan.technique(m).preview.any()) all.push_back(fmt::format("{} is a preview.", plan.method_name(m)));
        if (plan.technique(m).denoise) all.push_back(fmt::format("{} is denoised.", plan.method_name(m)));
    }
    return all;
}

std::vector<std::string> rankings(const Subject& subject, const Measurement& measured) {
    std::vector<std::string> lines;
    std::vector<const MethodResult*> comparable, own, biased;
    for (std::size_t m = 0; m < measured.methods.size(); ++m) {
        const MethodResult* method = &measured.methods[m];
        (method->biased && measured.by_variance ? biased : comparable).push_back(method);
        if (subject.plan.methods[m] != Method::external) own.push_back(method);
    }
    if (comparable.size() > 1) lines.push_back(ranking(subject, comparable, measured.by_variance));
    if (!measured.by_variance) return lines;
    if (!lines.empty())
        lines.back() += " Programs are compared by variance, because their MSE also holds differences between them.";
    for (const MethodResult* m : biased)
        lines.push_back(
            fmt::format("{} is not compared with {}. It is biased on request, which variance does not show.", m->name,
                        subject.plan.external.name));
    if (own.size() > 1) lines.push_back("Among the methods of Halflight: " + ranking(subject, own, false));
    return lines;
}

std::vector<std::string> advice(const Subject& subject, const Measurement& measured) {
    std::vector<std::string> lines = rankings(subject, measured);
    for (const auto& same : methods_of_same_pictures(measured)) {
        // Methods that make the same pictures differ in times alone, so the advice is for the fastest one.
        const MethodResult& m =
            **std::ranges::max_element(same, {}, [](const MethodResult* method) { return method->efficiency; });
        if (!m.stages.empty()) lines.push_back(fmt::format("{}: {}", m.name, stage_advice(m)));
    }
    return lines;
}

Json report_json(const Subject& subject, const Reference& reference, const Measurement& measured) {
    Json methods = Json::array(), runs = Json::array(), asked = Json::array(), budgets = Json::array();
    for (std::size_t m = 0; m < subject.plan.methods.size(); ++m) asked.push_back(subject.plan.method_name(m));
    for (const Budget& b : subject.plan.budgets) budgets.push_back(budget_json(b));
    for (const MethodResult& m : measured.methods) methods.push_back(method_json(subject, measured, m));
    for (const RunResult& r : measured.runs) runs.push_back(run_json(subject, r));
    Json agreements = Json::array();
    for (const MethodAgreement& a : measured.agreements) agreements.push_back(agreement_json(measured, a));
    const Json samples = reference.samples > 0 ? Json(reference.samples) : Json(nullptr);
    return {{"schema", kSchema},
            {"program", subject.program},
            {"scene", subject.scene},
            {"camera", subject.camera},
            {"environment", subject.environment},
            {"device", subject.device},
            {"width", subject.view.width},
            {"height", subject.view.height},
            {"bounces", subject.view.bounces},
            {"filter", {{"shape", name(subject.view.filter.shape)}, {"radius", subject.view.filter.radius}}},
            {"scene_preparation_seconds", subject.scene_seconds},
            {"pilots", subject.pilots},
            {"plan",
             {{"methods", asked},
              {"budgets", budgets},
              {"external", subject.plan.external.name.empty() ? Json() : Json(subject.plan.external.command)},
              {"seeds", subject.plan.seeds},
              {"first_seed", subject.plan.first_seed},
              {"clamp", subject.plan.clamp > 0 ? Json(subject.plan.clamp) : Json()},
              {"clock", subject.clock == Clock::cpu ? "cpu" : "wall"}}},
            {"definitions",
             {{"confidence", kConfidence},
              {"relative_mse_epsilon", kRelativeEpsilon},
              {"blur_pixels", 2 * kBlurRadius + 1},
              {"worst_share_of_pixels", kWorstShare}}},
            {"reference",
             {{"maker", reference.maker},
              {"reason", reference.reason},
              {"file", reference.file.string()},
              {"samples", samples},
              {"samples_found", reference.found},
              {"independent_halves", reference.halves_differ},
              {"seconds", seconds_json(reference.time)}}},
            {"biases", biases(subject.plan)},
            {"compared_by", measured.by_variance ? "variance" : "mse"},
            {"advice", advice(subject, measured)},
            {"same_pictures", {{"compared", measured.pictures_compared}, {"different", measured.pictures_different}}},
            {"methods", methods},
            {"agreements", agreements},
            {"runs", runs}};
}

std::string csv_field(const std::string& text) {
    if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
    std::string quoted = "\"";
    for (const char c : text) quoted.append(c == '"' ? 2 : 1, c);
    return quoted + "\"";
}

std::string report_csv(const Subject& subject, const Measurement& measured) {
    std::string csv =
        "method,budget_samples,budget_seconds,seed,samples,wall_seconds,cpu_seconds,mse,relative_mse,"
        "hdr_flip,trimmed_mse,blurred_mse";
    for (const char* component : kComponents) csv += fmt::format(",{}_mse", component);
    csv += ",non_finite\r\n";  // RFC 4180
    for (const RunResult& r : measured.runs) {
        const Budget& b = subject.plan.budgets[static_cast<std::size_t>(r.run.budget)];
        csv += fmt::format("{},{},{},{},{},{},{},{},{},{},{},{}",
                           csv_field(subject.plan.method_name(static_cast<std::size_t>(r.run.method))), b.samples,
                           b.seconds, r.run.seed, r.samples, r.time.wall, r.time.cpu, r.mse, r.relative_mse,
                           r.errors.flip, r.errors.trimmed_mse, r.blurred_mse);
        for (const double component : r.errors.components)
            csv += r.errors.has_components ? fmt::format(",{}", component) : ",";
        csv += fmt::format(",{}\r\n", r.non_finite);
    }
    return csv;
}

}  // namespace halflight::converge
