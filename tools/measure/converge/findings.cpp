#include <fmt/format.h>

#include <cmath>
#include <optional>

#include "engine/core/metrics.h"
#include "tools/measure/converge/measure.h"

namespace halflight::converge {
namespace {

using Kind = Finding::Kind;

/// How far from -1 a slope may be, and how wide its interval.
constexpr double kTolerance = 0.1;

double percent(double share) {
    return 100 * share;
}

std::string superscript(int exponent) {
    constexpr const char* kDigits[] = {"⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};
    std::string digits;
    for (const char c : std::to_string(std::abs(exponent))) digits += kDigits[c - '0'];
    return (exponent < 0 ? "⁻" : "") + digits;
}

/// What the errors at the largest budget say.
std::vector<Finding> findings_of_errors(const MethodResult& m) {
    std::vector<Finding> findings;
    const Point& last = m.points.back();
    if (last.bias_squared.lower() > 0) {
        findings.push_back(
            {Kind::bias, fmt::format("At the largest budget the squared bias is {}, {:.0f} % "
                                     "of the MSE: no budget brings the error below it.",
                                     text(last.bias_squared), percent(last.bias_squared.value / last.mse.value))});
    }
    if (last.worst_share > 0.5 && kWorstShare * m.picture.width * m.picture.height >= 1) {
        findings.push_back(
            {Kind::heavy_tails, fmt::format("At the largest budget the worst {:g} % of the pixels hold {:.0f} % of the "
                                            "squared error; without them the slope is {}.",
                                            percent(kWorstShare), percent(last.worst_share), text(m.slope_trimmed))});
    }
    return findings;
}

/// `explained`: there is a finding that a flat slope may be due to.
std::optional<Finding> finding_of_slope(const MethodResult& m, bool explained) {
    const Interval& slope = m.slope.slope;
    if (!is_known(m.slope))
        return Finding{Kind::inconclusive, "No slope is known: that takes two budgets of several seeds, or three."};
    const Interval& by_samples = m.slope_by_samples.slope;
    const std::string deviation =
        fmt::format("The slope {} is {} than -1", text(slope), slope.value < -1 ? "steeper" : "flatter");
    if (std::abs(slope.value + 1) > kTolerance && std::abs(by_samples.value + 1) <= kTolerance &&
        by_samples.half_width <= kTolerance)
        return Finding{Kind::fixed_time, fmt::format("{}, but against samples it is {}: time is not in proportion to "
                                                     "samples, a part of it is each picture's own.",
                                                     deviation, text(by_samples))};
    if (std::abs(slope.value + 1) > kTolerance && !slope.holds(-1)) {
        if (slope.value < -1)
            return Finding{Kind::faster, fmt::format("{}: where the integrand is smooth, stratified samples "
                                                     "converge faster than independent ones.",
                                                     deviation)};
        if (!explained) return Finding{Kind::unclear, deviation + "; neither bias nor heavy tails show."};
    } else if (!(slope.half_width <= kTolerance)) {
        return Finding{Kind::inconclusive, fmt::format("The slope {} is not known to {:g}: more seeds or budgets "
                                                       "would tell.",
                                                       text(slope), kTolerance)};
    }
    return std::nullopt;
}

}  // namespace

std::string text(const Interval& i) {
    if (!std::isfinite(i.half_width)) return fmt::format("{:.3g}", i.value);
    const double largest = std::max(std::abs(i.value), i.half_width);
    if (!(largest > 0)) return "0";
    const int exponent = static_cast<int>(std::floor(std::log10(largest)));
    // Two digits of the half width.
    const int last = i.half_width > 0 ? static_cast<int>(std::floor(std::log10(i.half_width))) - 1 : exponent - 2;
    if (exponent >= -2 && exponent <= 3) {
        const int digits = std::clamp(-last, 0, 4);
        return fmt::format("{:.{}f} ± {:.{}f}", i.value, digits, i.half_width, digits);
    }
    const double scale = std::pow(10.0, exponent);
    const int digits = std::clamp(exponent - last, 1, 3);
    return fmt::format("({:.{}f} ± {:.{}f})·10{}", i.value / scale, digits, i.half_width / scale, digits,
                       superscript(exponent));
}

bool is_known(const Slope& s) {
    return s.points >= 2 && std::isfinite(s.slope.half_width);
}

std::string text(const Slope& s) {
    return is_known(s) ? text(s.slope) : "none";
}

std::string_view name(Kind kind) {
    switch (kind) {
        case Kind::bias:
            return "bias";
        case Kind::heavy_tails:
            return "heavy tails";
        case Kind::fixed_time:
            return "fixed time";
        case Kind::faster:
            return "faster than random";
        case Kind::inconclusive:
            return "inconclusive";
        case Kind::unclear:
            return "unclear";
        case Kind::noisy_reference:
            return "noisy reference";
    }
    return "unknown";
}

std::vector<Finding> findings_of(const MethodResult& m) {
    std::vector<Finding> findings = findings_of_errors(m);
    if (const auto finding = finding_of_slope(m, !findings.empty())) findings.push_back(*finding);
    const Point& last = m.points.back();
    if (last.reference_variance > last.mse.value) {
        findings.push_back({Kind::noisy_reference,
                            fmt::format("The reference's own variance, {:.2g}, is greater than the MSE at the largest "
                                        "budget, {:.2g}: more samples of it would make all figures more certain.",
                                        last.reference_variance, last.mse.value)});
    }
    return findings;
}

}  // namespace halflight::converge
