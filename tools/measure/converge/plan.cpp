#include "tools/measure/converge/plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace halflight::converge {
namespace {

constexpr Method kNamedMethods[] = {Method::compute, Method::raster, Method::plain, Method::native, Method::oracle};

}  // namespace

std::string_view name(Method method) {
    switch (method) {
        case Method::compute:
            return "compute";
        case Method::raster:
            return "raster";
        case Method::plain:
            return "plain";
        case Method::native:
            return "native";
        case Method::oracle:
            return "oracle";
        case Method::external:
            return "external";
    }
    return "unknown";
}

std::string known_methods() {
    std::string names;
    for (const Method method : kNamedMethods) names += (names.empty() ? "" : ", ") + std::string(name(method));
    return names;
}

std::optional<Method> method_named(std::string_view wanted) {
    const auto found = std::ranges::find(kNamedMethods, wanted, name);
    return found == std::end(kNamedMethods) ? std::nullopt : std::optional(*found);
}

std::string text(const Budget& budget) {
    if (budget.seconds > 0) return fmt::format("{:g} s", budget.seconds);
    return fmt::format("{} sample{}", budget.samples, budget.samples == 1 ? "" : "s");
}

std::string Plan::method_name(std::size_t method) const {
    if (methods[method] == Method::external) return external.name;
    std::string own(name(methods[method]));
    const auto of_halflight = [&] { return "Halflight (" + own + ")"; };
    if (!uses_gl(methods[method])) return of_halflight();
    const Technique mine = technique(method);
    std::vector<Estimator> others;
    bool previews = false, denoise = false;
    for (std::size_t other = 0; other < methods.size(); ++other) {
        if (!uses_gl(methods[other])) continue;
        const Technique its = technique(other);
        others.push_back(its.estimator);
        previews |= its.preview.any();
        denoise |= its.denoise;
    }
    if (previews) own += fmt::format(" preview={}", text(mine.preview));
    if (denoise) own += mine.denoise ? " denoise=on" : " denoise=none";
    const std::string apart = difference(mine.estimator, others);
    if (!apart.empty()) own += " " + apart;
    return of_halflight();
}

bool Plan::is_biased(std::size_t method) const {
    const Technique its = technique(method);
    return uses_gl(methods[method]) && (clamp > 0 || its.preview.any() || its.denoise);
}

bool Plan::same_pictures(std::size_t method, std::size_t other) const {
    return uses_gl(methods[method]) && uses_gl(methods[other]) && technique(method) == technique(other);
}

void compare(Plan& plan, const std::vector<Technique>& techniques) {
    const std::vector<Method> asked = std::exchange(plan.methods, {});
    plan.techniques.clear();
    for (const Method method : asked) {
        const bool gl = uses_gl(method) && !techniques.empty();
        for (const Technique& technique : gl ? techniques : std::vector{Technique()}) {
            plan.methods.push_back(method);
            plan.techniques.push_back(technique);
        }
    }
}

std::vector<Run> runs_of(const Plan& plan) {
    const int methods = static_cast<int>(plan.methods.size()), budgets = static_cast<int>(plan.budgets.size());
    std::vector<Run> runs;
    for (int repeat = 0; repeat < plan.seeds; ++repeat) {
        for (int b = 0; b < budgets; ++b) {
            const int turn = repeat * budgets + b, budget = (repeat + b) % budgets;
            const auto number = static_cast<std::uint32_t>(budget * plan.seeds + repeat);
            const std::uint32_t seed = 1 + (plan.first_seed - 1 + number) % (kSeedsOfMethods - 1);
            for (int m = 0; m < methods; ++m) runs.push_back({(turn + m) % methods, budget, repeat, seed});
        }
    }
    return runs;
}

}  // namespace halflight::converge
