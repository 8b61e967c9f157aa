// Plans the pictures of a measurement and their order.
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
    native,   // tracing by vector code, for drivers that render on the processor
    oracle,   // the CPU path tracer of engine/reference
    external  // another renderer (external.h)
};
/// Methods that are always available.
inline constexpr Method kUsualMethods[] = {Method::compute, Method::raster, Method::plain, Method::oracle};
/// Returns the names of all methods but Method::external, separated by commas.
std::string known_methods();
std::string_view name(Method method);
/// Returns the method of this name, other than Method::external; none for an unknown name.
std::optional<Method> method_named(std::string_view name);
/// Returns whether the method renders by GL. Such methods make the same picture of the same seed, samples and
/// estimator.
inline bool uses_gl(Method method) {
    return method != Method::oracle && method != Method::external;
}

/// How a method that renders by GL makes its pictures.
struct Technique {
    Estimator estimator{};
    Preview preview{};     // RenderSettings::preview
    bool denoise = false;  // RenderSettings::denoise
    bool operator==(const Technique&) const = default;
};

/// Another renderer; external.h lists the placeholders of its command.
struct External {
    std::string name;
    std::string command;
};

/// Length of a run, given by the one member that is greater than 0.
struct Budget {
    int samples = 0;     // samples per pixel
    double seconds = 0;  // wall time, seconds; at least one sample is taken
};
std::string text(const Budget& budget);  ///< Returns "16 samples" or "0.5 s".

struct Plan {
    std::vector<Method> methods;          // methods, distinct together with their techniques
    std::vector<Budget> budgets;          // budgets in samples or in seconds, ascending
    int seeds = 8;                        // number of independent pictures of each method and budget, > 0
    std::uint32_t first_seed = 1;         // seed of the first picture, [1, kSeedsOfMethods)
    float clamp = 0;                      // RenderSettings::clamp of GL methods, a bias; references are not clamped
    std::vector<Technique> techniques{};  // technique of each method; empty: the default one for all
    External external{};                  // renderer of Method::external
    int warm_up = 0;  // samples by another camera that fill the radiance cache before each picture; not timed

    Technique technique(std::size_t method) const { return techniques.empty() ? Technique() : techniques[method]; }
    /// Returns program and method: "Halflight (plain)", or "Halflight (plain lights=tree preview=cache denoise=on)"
    /// with the choices that distinguish its technique from the others; the name of another renderer.
    std::string method_name(std::size_t method) const;
    /// Returns whether settings of the plan keep the method's pictures from converging: previews, denoising, a clamp.
    bool is_biased(std::size_t method) const;
    /// Returns whether both methods make the same picture of the same seed and samples.
    bool same_pictures(std::size_t method, std::size_t other) const;
};
/// Replaces each method that uses GL by one for each technique. techniques: distinct; empty: the default one.
void compare(Plan& plan, const std::vector<Technique>& techniques);

/// One picture to render. `method` and `budget` are indices into the plan.
struct Run {
    int method = 0;
    int budget = 0;
    int repeat = 0;
    std::uint32_t seed = 0;
};

/// Upper bound of the seeds of methods; seeds of references are not below it.
inline constexpr std::uint32_t kSeedsOfMethods = 1u << 31;

/// Returns every picture of the plan. Each budget and repeat has its own seed, which all methods share. Seeds count
/// from the first one, and continue at 1 after the last one below kSeedsOfMethods. A turn is one run of each method.
/// The order of methods rotates from turn to turn, and each repeat begins with another budget. Thus the load by other
/// programs affects all methods alike.
std::vector<Run> runs_of(const Plan& plan);

}  // namespace halflight::converge
