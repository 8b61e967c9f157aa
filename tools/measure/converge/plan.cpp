#include "tools/measure/converge/plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace halflight::converge {

std::string_view name(Method method) {
    switch (method) {
        case Method::compute:
            return "compute";
        case Method::raster:
            return "raster";
        case Method::plain:
            return "plain";
        case Method::oracle:
            return "oracle";
        case Method::external:
            return "external";
    }
    return "unknown";
}

std::optional<Method> method_named(std::string_view wanted) {
    const auto found = std::ranges::find(kMethods, wanted, name);
    return found == std::end(kMethods) ? std::nullopt : std::optional(*found);
}

std::string text(const Budget& budget) {
    if (budget.seconds > 0) return fmt::format("{:g} s", budget.seconds);
    return fmt::format("{} sample{}", budget.samples, budget.samples == 1 ? "" : "s");
}

std::string Plan::method_name(std::size_t method) const {
    if (methods[method] == Method::external) return external.name;
    std::string own(name(methods[method]));
    if (!uses_gl(methods[method])) return own;
    if (!previews.empty()) own += fmt::format(" preview={}", text(previews[method]));
    if (estimators.empty()) return own;
    std::vector<Estimator> others;
    for (std::size_t other = 0; other < methods.size(); ++other)
        if (uses_gl(methods[other])) others.push_back(estimators[other]);
    const std::string apart = difference(estimators[method], others);
    return apart.empty() ? own : own + " " + apart;
}

bool Plan::same_pictures(std::size_t method, std::size_t other) const {
    return uses_gl(methods[method]) && uses_gl(methods[other]) && estimator(method) == estimator(other) &&
           preview(method) == preview(other);
}

void compare_estimators(Plan& plan, const std::vector<Estimator>& estimators) {
    const std::vector<Method> asked = std::exchange(plan.methods, {});
    plan.estimators.clear();
    for (const Method method : asked) {
        for (const Estimator& estimator : estimators) {
            plan.methods.push_back(method);
            plan.estimators.push_back(uses_gl(method) ? estimator : Estimator());
            if (!uses_gl(method)) break;
        }
    }
}

void compare_previews(Plan& plan, const std::vector<Preview>& previews) {
    Plan all = plan;
    all.methods.clear(), all.estimators.clear(), all.previews.clear();
    for (std::size_t m = 0; m < plan.methods.size(); ++m) {
        for (const Preview& preview : previews) {
            const bool gl = uses_gl(plan.methods[m]);
            all.methods.push_back(plan.methods[m]);
            all.estimators.push_back(plan.estimator(m));
            all.previews.push_back(gl ? preview : Preview());
            if (!gl) break;
        }
    }
    if (plan.estimators.empty()) all.estimators.clear();
    plan = std::move(all);
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
