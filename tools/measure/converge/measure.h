// The runs of a plan, and what they say.
#pragma once

#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "engine/core/statistics.h"
#include "tools/measure/bench/bench.h"
#include "tools/measure/converge/errors.h"

namespace halflight::converge {

using bench::Clock;

/// Of the blur that tells how error is spread over the screen: 5 x 5 pixels.
inline constexpr int kBlurRadius = 2;

struct RunResult {
    Run run;
    int samples = 0;  // per pixel
    Seconds time;
    double mse = 0;
    double relative_mse = 0;
    double blurred_mse = 0;
    RunErrors errors;
    std::uint64_t non_finite = 0;
};

/// One method at one budget: all seeds.
struct Point {
    double samples = 0;  // per pixel, mean
    Seconds time;        // mean of one picture
    Interval mse, relative_mse, flip;
    Interval off_edges_mse;  // mse without what pixels on edges of what glows add (weights_off_edges()), or not known
    Interval blurred_mse;    // mse where picture and reference are blurred (kBlurRadius)
    Interval bias_squared, variance;                      // parts of mse
    Interval relative_bias;                               // of the picture's mean
    double reference_variance = 0;                        // that the errors are without
    double trimmed_mse = 0;                               // mean
    double worst_share = 0;                               // of the squared error, that kWorstShare of the pixels hold
    bool has_components = false;                          // else these are 0
    std::array<double, kComponents.size()> components{};  // mean mse of each
};

/// What takes the time, and the errors that it answers for.
struct Stage {
    std::string name;
    double seconds = 0;
    double time_share = 0;   // of all stages
    double error_share = 0;  // of the sum of the components' errors
    /// By how much the efficiency, 1 / (mse x seconds), is multiplied if this stage alone takes twice the samples.
    Interval gain{1, 0};  // over seeds; the time of a stage is one picture's
};

struct Finding {
    enum class Kind : std::uint8_t { bias, heavy_tails, fixed_time, faster, inconclusive, unclear, noisy_reference };
    Kind kind;
    std::string text;  // a sentence
};
std::string_view name(Finding::Kind kind);

struct MethodResult {
    std::string name;              // of the method
    Seconds preparation;           // before the first picture
    std::vector<Point> points;     // by budget
    Slope slope;                   // of mse over the time of the plan's clock
    Slope slope_by_samples;        // of mse
    Slope slope_trimmed;           // of trimmed_mse over time
    double efficiency = 0;         // 1 / (mse x seconds) at the largest budget
    std::vector<PassTime> passes;  // of one more picture of the largest budget; empty for those without GL
    std::vector<Stage> stages;
    Interval stage_lead{0, std::numeric_limits<double>::infinity()};  // of the greatest gain over the second one
    std::vector<Finding> findings;
    Image picture;  // of the largest budget's first seed
    Image mean;     // of the largest budget's seeds
};

struct Measurement {
    std::vector<RunResult> runs;  // in the order in which they were made
    std::vector<MethodResult> methods;
    int pictures_compared = 0;   // of GL methods with the first one's of the same seed and samples
    int pictures_different = 0;  // of these, not the same bit for bit
};

/// Which stage a pass of the frame belongs to, as index of a list of names: 0 camera rays and film, 1 direct light,
/// 2 indirect light.
std::size_t stage_of(std::string_view pass);

struct MeasureHooks {
    Pulse pulse;
    std::function<void(double)> progress;
};
/// painters: one per method of the plan. Each makes a picture beforehand, which does not count. Keeps the pictures of
/// all seeds in memory.
Measurement measure(const Plan& plan, const std::vector<std::unique_ptr<Painter>>& painters, const Reference& reference,
                    Clock clock, const MeasureHooks& hooks);

/// "(2.31 ± 0.12)·10⁻⁴": value and half width, to as many digits as the interval knows.
std::string text(const Interval& interval);
/// Two points or more tell it, and how well.
bool is_known(const Slope& slope);
std::string text(const Slope& slope);  ///< "none" where it is not known

/// Seconds of the plan's clock until a method's mse, taken as a line between budgets in the plot, stays down at `mse`;
/// below the first budget: its seconds; above the last one: infinity. off_edges: off_edges_mse instead.
double seconds_until(const MethodResult& method, double mse, Clock clock, bool off_edges = false);

/// What the slope and the errors of a method say about it; slopes, points and picture must be set.
std::vector<Finding> findings_of(const MethodResult& method);

}  // namespace halflight::converge
