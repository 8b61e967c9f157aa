// What is run, and in which order.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/settings/estimator.h"
#include "engine/settings/preview.h"

namespace halflight::converge {

enum class Method : std::uint8_t {
    compute,  // culling by tiles, all in compute kernels
    raster,   // culling by occlusion queries over rasterized tiles
    plain,    // no culling
    oracle,   // the CPU path tracer of engine/reference
    external  // another renderer (external.h)
};
/// Those that are always there.
inline constexpr Method kMethods[] = {Method::compute, Method::raster, Method::plain, Method::oracle};
std::string_view name(Method method);
/// Null for a name that is none.
std::optional<Method> method_named(std::string_view name);
/// Those that do make the same picture of the same seed, samples and estimator.
inline bool uses_gl(Method method) {
    return method != Method::oracle && method != Method::external;
}

/// Another renderer; external.h lists the placeholders of its command.
struct External {
    std::string name;
    std::string command;
};

/// Either is > 0, the other one 0.
struct Budget {
    int samples = 0;     // per pixel
    double seconds = 0;  // of wall time; at least one sample is taken
};
std::string text(const Budget& budget);  ///< "16 samples", "0.5 s"

struct Plan {
    std::vector<Method> methods;   // with their estimators no two alike
    std::vector<Budget> budgets;   // all of samples or all of seconds, growing
    int seeds = 8;                 // > 0: independent pictures of each budget
    std::uint32_t first_seed = 1;  // of runs_of()
    float clamp = 0;  // of the pictures of GL methods (RenderSettings::clamp), a bias; never of the reference
    std::vector<Estimator> estimators{};  // of each method; empty: the default one for all

    std::vector<Preview> previews{};  // likewise; never of the reference
    External external{};              // of Method::external
    int warm_up = 0;  // samples from elsewhere that fill the radiance cache before each picture that uses it, not timed

    Preview preview(std::size_t method) const { return previews.empty() ? Preview() : previews[method]; }
    Estimator estimator(std::size_t method) const { return estimators.empty() ? Estimator() : estimators[method]; }
    /// "plain", or "plain lights=tree preview=cache" where estimators or previews are compared: by what sets them
    /// apart.
    std::string method_name(std::size_t method) const;
    /// Whether both make the same picture of the same seed and samples.
    bool same_pictures(std::size_t method, std::size_t other) const;
};
/// Each method that uses GL with each of the estimators, the oracle once.
void compare_estimators(Plan& plan, const std::vector<Estimator>& estimators);
/// Each of what there is that uses GL with each of the previews; after the estimators.
void compare_previews(Plan& plan, const std::vector<Preview>& previews);

/// One picture to be made. Indices are into the plan.
struct Run {
    int method = 0;
    int budget = 0;
    int repeat = 0;
    std::uint32_t seed = 0;
};

/// Seeds of methods are below it, those of references are not.
inline constexpr std::uint32_t kSeedsOfMethods = 1u << 31;

/// Every picture of the plan. Seeds count from the first one, and go on at 1 after the last one below kSeedsOfMethods.
/// Budgets and repeats have a seed of their own, the same one for all methods. A turn, which
/// is one run of each method, rotates the order of the methods by one; each repeat goes through the budgets from
/// another one on: what else the machine does falls on all alike.
std::vector<Run> runs_of(const Plan& plan);

}  // namespace halflight::converge
