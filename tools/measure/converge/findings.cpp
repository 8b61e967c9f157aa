#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "engine/core/metrics.h"
#include "tools/measure/converge/measure.h"

namespace halflight::converge {
namespace {

using Kind = Finding::Kind;

/// Largest distance of a slope from -1, and largest half width of its interval, that raise no finding.
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

/// Returns the findings about the errors at the largest budget.
std::vector<Finding> findings_of_errors(const MethodResult& m) {
    std::vector<Finding> findings;
    const Point& last = m.points.back();
    if (last.bias_squared.lower() > 0) {
        findings.push_back(
            {m.own_reference ? Kind::bias : Kind::difference,
             fmt::format("At the largest budget the squared {} is {}, which is {:.0f} % of the MSE. More "
                         "samples do not reduce it.",
                         m.own_reference ? "bias" : "difference from the reference", text(last.bias_squared),
                         percent(last.bias_squared.value / last.mse.value))});
    }
    if (last.worst_share > 0.5 && kWorstShare * m.picture.width * m.picture.height >= 1) {
        findings.push_back({Kind::heavy_tails,
                            fmt::format("At the largest budget the worst {:g} % of the pixels cause {:.0f} % of the "
                                        "squared error. Without them the slope is {}.",
                                        percent(kWorstShare), percent(last.worst_share), text(m.slope_trimmed))});
    }
    return findings;
}

/// Returns a finding about the slope. explained: another finding may be the cause of a flat slope.
std::optional<Finding> finding_of_slope(const MethodResult& m, bool explained) {
    const Interval& slope = m.slope.slope;
    if (!is_known(m.slope))
        return Finding{Kind::inconclusive,
                       "The slope is not known. It takes two budgets with several seeds, or three budgets."};
    const Interval& by_samples = m.slope_by_samples.slope;
    const std::string deviation =
        fmt::format("The slope {} is {} than -1", text(slope), slope.value < -1 ? "steeper" : "flatter");
    const bool by_samples_is_known =
        std::abs(by_samples.value + 1) <= kTolerance && by_samples.half_width <= kTolerance;
    const bool is_of_time = !slope.holds(-1) && by_samples.holds(-1);
    if (std::abs(slope.value + 1) > kTolerance && (by_samples_is_known || is_of_time))
        return Finding{Kind::fixed_time, fmt::format("{}, but the slope against samples is {}. A part of the time does "
                                                     "not grow with the samples.",
                                                     deviation, text(by_samples))};
    if (std::abs(slope.value + 1) > kTolerance && !slope.holds(-1)) {
        if (slope.value < -1)
            return Finding{Kind::faster, fmt::format("{}. Stratified samples converge faster than independent ones "
                                                     "where the integrand is smooth.",
                                                     deviation)};
        if (!explained)
            return Finding{Kind::unclear,
                           fmt::format("{}. Neither {} nor heavy tails are visible.", deviation, m.offset())};
    } else if (!(slope.half_width <= kTolerance)) {
        return Finding{Kind::inconclusive, fmt::format("The slope {} is not known to within {:g}. More seeds or "
                                                       "budgets would tell.",
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
    // Two digits of the half width remain.
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

std::string verdict_text(const MethodAgreement& found, const std::vector<MethodResult>& methods) {
    const std::string both = fmt::format("{} and {}", methods[found.external].name, methods[found.method].name);
    switch (found.agreement.verdict()) {
        case Verdict::agree:
            return both + " agree.";
        case Verdict::differ:
            return both + " differ.";
        case Verdict::undecided:
            return fmt::format("The noise is too large to tell whether {} agree.", both);
    }
    return both;
}

std::string reasons_text(const MethodAgreement& found, const std::vector<MethodResult>& methods) {
    const Agreement& a = found.agreement;
    const MethodResult& theirs = methods[found.external];
    const Point& last = theirs.points.back();
    const Interval mean = a.whole.interval();
    std::string reasons =
        fmt::format("The mean of {} differs by {:+.3f} % ({:g} % interval {:+.3f} % to {:+.3f} %; tolerance {:g} %).",
                    theirs.name, percent(mean.value), percent(kConfidence), percent(mean.lower()),
                    percent(mean.upper()), percent(kWholeTolerance));
    if (!a.blocks.empty())
        reasons += fmt::format(
            " {} of {} blocks of {}x{} pixels differ by more than {:g} % and a standard error, {:.2g} expected by "
            "noise. "
            "The chi-square test of all blocks against noise has p {}.",
            a.beyond, a.blocks.size(), a.side, a.side, percent(a.tolerance), a.expected_beyond,
            a.chance_of_blocks < 1e-6 ? "< 0.000001" : fmt::format("= {:.2g}", a.chance_of_blocks));
    if (a.chance_of_worst < kSignificance) {
        const Block& worst = a.blocks[a.worst];
        reasons += fmt::format(
            " The block at ({}, {}) differs by {:+.2f} %. Noise puts a block so far beyond {:g} % with p < {:g}.",
            worst.x, worst.y, percent(worst.difference.relative), percent(a.tolerance), kSignificance);
    }
    if (last.mse.value > 0)
        reasons +=
            fmt::format(" {:.0f} % of the MSE of {} is squared difference from the reference, {:.0f} % variance.",
                        percent(std::clamp(last.bias_squared.value / last.mse.value, 0.0, 1.0)), theirs.name,
                        percent(std::clamp(last.variance.value / last.mse.value, 0.0, 1.0)));
    return reasons;
}

std::string_view name(Kind kind) {
    switch (kind) {
        case Kind::bias:
            return "bias";
        case Kind::difference:
            return "difference";
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
                            fmt::format("The variance of the reference, {:.2g}, is greater than the MSE at the largest "
                                        "budget, {:.2g}. A reference with more samples would make all figures more "
                                        "certain.",
                                        last.reference_variance, last.mse.value)});
    }
    return findings;
}

}  // namespace halflight::converge
