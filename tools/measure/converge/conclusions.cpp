#include "tools/measure/converge/conclusions.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "engine/core/image_tools.h"

namespace halflight::converge {
namespace {

using Kind = Finding::Kind;
using Methods = std::vector<const MethodResult*>;

/// Returns the style of a finding: better than expected, not known, or a problem.
const char* style_of(Kind kind) {
    return kind == Kind::faster                                          ? "fine"
           : kind == Kind::inconclusive || kind == Kind::noisy_reference ? "open"
                                                                         : "flag";
}

const char* style_of(Verdict verdict) {
    return verdict == Verdict::agree ? "fine" : verdict == Verdict::differ ? "flag" : "open";
}

/// Returns whether a finding is about the slope against time, which differs between methods that make equal pictures.
bool is_of_slope(Kind kind) {
    return kind == Kind::fixed_time || kind == Kind::faster || kind == Kind::inconclusive || kind == Kind::unclear;
}

const Finding* slope_finding(const MethodResult& m) {
    const auto found = std::ranges::find_if(m.findings, [](const Finding& f) { return is_of_slope(f.kind); });
    return found == m.findings.end() ? nullptr : &*found;
}

/// Adds the findings of methods that make the same pictures.
void add_findings(const Methods& same, std::vector<Conclusion>& all) {
    const std::string names = names_of(same);
    const std::size_t before = all.size();
    for (const Finding& f : same.front()->findings)
        if (!is_of_slope(f.kind))
            all.push_back({fmt::format("{}: {}.", names, name(f.kind)), f.text, style_of(f.kind)});
    const auto settled = [](const MethodResult* m) {
        const Finding* f = slope_finding(*m);
        return !f || f->kind != Kind::inconclusive;
    };
    const bool known = std::ranges::any_of(same, settled);
    std::set<Kind> told;
    for (const MethodResult* m : same) {
        const Finding* f = slope_finding(*m);
        if (!f || (known && f->kind == Kind::inconclusive)) continue;
        // One of several methods that say the same speaks for all.
        if (!told.insert(f->kind).second) continue;
        const bool alone = std::ranges::count_if(same, [&](const MethodResult* other) {
                               const Finding* of_other = slope_finding(*other);
                               return of_other && of_other->kind == f->kind;
                           }) == 1;
        all.push_back({fmt::format("{}: {}.", alone ? m->name : names, name(f->kind)), f->text, style_of(f->kind)});
    }
    if (all.size() == before)
        all.push_back({names + ": no findings.",
                       fmt::format("The squared {} is zero within its interval, and the slope is -1 within 0.1 or "
                                   "within its interval.",
                                   same.front()->offset()),
                       "fine"});
}

}  // namespace

std::vector<Methods> methods_of_same_pictures(const Measurement& measured) {
    std::vector<Methods> groups;
    for (const MethodResult& m : measured.methods) {
        const auto same =
            std::ranges::find_if(groups, [&](const Methods& g) { return same_bits(g.front()->mean, m.mean); });
        if (same == groups.end())
            groups.push_back({&m});
        else
            same->push_back(&m);
    }
    return groups;
}

std::string names_of(const Methods& methods) {
    std::string names;
    for (const MethodResult* m : methods) names += (names.empty() ? "" : " = ") + m->name;
    return names;
}

std::vector<Conclusion> conclusions(const Subject& subject, const Measurement& measured) {
    std::vector<Conclusion> all;
    for (const MethodAgreement& a : measured.agreements)
        all.push_back(
            {verdict_text(a, measured.methods), reasons_text(a, measured.methods), style_of(a.agreement.verdict())});
    if (!subject.plan.external.name.empty() && measured.agreements.empty())
        all.push_back({"Agreement is not known.",
                       fmt::format("One seed does not show noise. Efficiencies may hold differences between {} and "
                                   "Halflight.",
                                   subject.plan.external.name),
                       "open"});
    for (const std::string& line : advice(subject, measured)) all.push_back({"", line});
    const std::vector<Methods> groups = methods_of_same_pictures(measured);
    for (const Methods& same : groups)
        if (same.size() > 1)
            all.push_back({names_of(same) + ".",
                           "These methods make the same pictures, bit for bit. Only times differ.", "fine"});
    for (const Methods& same : groups) add_findings(same, all);
    return all;
}

std::string explanation(Method method) {
    switch (method) {
        case Method::compute:
            return "The renderer of Halflight. Compute shaders cull the hierarchy for tiles of rays (--culling "
                   "compute).";
        case Method::raster:
            return "The renderer of Halflight. Occlusion queries cull the hierarchy for tiles of rays (--culling "
                   "raster).";
        case Method::plain:
            return "The renderer of Halflight. Each ray walks the hierarchy by itself in a shader (--culling off).";
        case Method::native:
            return "The renderer of Halflight. Vector code on the processor traces the rays (--culling native).";
        case Method::oracle:
            return "An independent path tracer on Embree, which shares no code with the renderer and serves as a "
                   "check.";
        case Method::external:
            return "Another program, whose command is under “Method of measurement”.";
    }
    return "";
}

}  // namespace halflight::converge
