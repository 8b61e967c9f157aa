// Runs a plan, and derives statistics and findings from its pictures.
#pragma once

#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "engine/core/statistics.h"
#include "tools/measure/common/clock.h"
#include "tools/measure/converge/agreement.h"
#include "tools/measure/converge/errors.h"

namespace halflight::converge {

/// Radius, pixels, of the blur before a second measurement, which shows the spatial distribution of errors.
inline constexpr int kBlurRadius = 2;

struct RunResult {
    Run run;
    int samples = 0;  // samples per pixel
    Seconds time;
    double mse = 0;           // mean squared error, without the reference's own variance
    double relative_mse = 0;  // each squared error divided by the reference's square plus kRelativeEpsilon
    double blurred_mse = 0;   // mse of the blurred picture and the blurred reference (kBlurRadius)
    RunErrors errors;
    std::uint64_t non_finite = 0;  // number of values that are NaN or infinite
};

/// Statistics of one method at one budget, over all seeds.
struct Point {
    double samples = 0;         // mean samples per pixel
    Seconds time;               // mean time of one picture
    Interval paths_per_second;  // pixels times samples, by the plan's clock
    Interval mse, relative_mse, flip;
    Interval
        off_edges_mse;     // mse over the pixels that no edge of a light crosses (weights_off_edges()); NaN: not known
    Interval blurred_mse;  // mse of the blurred picture and the blurred reference (kBlurRadius)
    Interval bias_squared, variance;                      // parts of mse
    Interval off_edges_variance;                          // part of off_edges_mse
    Interval relative_bias;                               // relative bias of the picture's mean
    double reference_variance = 0;                        // variance of the reference, which is not part of the errors
    double trimmed_mse = 0;                               // mean mse without the worst kWorstShare of the pixels
    double worst_share = 0;                               // share of the squared error in the worst pixels, [0, 1]
    bool has_components = false;                          // false: `components` is 0
    std::array<double, kComponents.size()> components{};  // mean mse of each component
};

/// A part of the frame's passes, and the components of the error that it is responsible for.
struct Stage {
    std::string name;
    double seconds = 0;      // time in one picture, seconds
    double time_share = 0;   // share in the time of all stages, [0, 1]
    double error_share = 0;  // share in the sum of the components' errors, [0, 1]
    Interval gain{1, 0};  // factor of the efficiency, 1 / (mse x seconds), if this stage alone took twice the samples
};

struct Finding {
    enum class Kind : std::uint8_t {
        bias,
        difference,
        heavy_tails,
        fixed_time,
        faster,
        inconclusive,
        unclear,
        noisy_reference
    };
    Kind kind;
    std::string text;  // one sentence
};
std::string_view name(Finding::Kind kind);

struct MethodResult {
    std::string name;
    bool own_reference = true;  // false: another program made the pictures, or the reference's maker is not known
    bool biased = false;        // Plan::is_biased()
    Seconds preparation;        // time before the first picture
    std::vector<Point> points;  // one point per budget
    Slope slope;                // log mse against log time
    Slope slope_by_samples;     // log mse against log samples
    Slope slope_trimmed;        // log trimmed_mse against log time
    double efficiency = 0;      // 1 / (mse x seconds) at the largest budget; 0: not known
    double efficiency_by_variance = 0;  // 1 / (variance x seconds); 0: not known
    std::vector<PassTime> passes;       // times in one more picture of the largest budget; empty for methods without GL
    std::vector<Stage> stages;
    Interval stage_lead{0, std::numeric_limits<double>::infinity()};  // greatest gain minus the second greatest
    std::vector<Finding> findings;
    Image picture;  // picture of the first seed at the largest budget
    Image mean;     // mean picture of the seeds at the largest budget

    /// Returns the name of the offset between expectation and reference: "bias", or "difference" if it also holds
    /// differences between the models of programs.
    const char* offset() const { return own_reference ? "bias" : "difference"; }
};

/// Difference between the external renderer's pictures of the largest budget and a method's.
struct MethodAgreement {
    std::size_t method = 0;    // index of the method
    std::size_t external = 0;  // index of the external renderer
    Agreement agreement;       // `theirs` are the external renderer's pictures
};

struct Measurement {
    std::vector<RunResult> runs;  // runs in the order in which they were made
    std::vector<MethodResult> methods;
    std::vector<MethodAgreement>
        agreements;              // one per set of methods that make the same pictures; empty for a single seed
    bool by_variance = false;    // true: differences between programs are part of errors, so variances compare them
    int pictures_compared = 0;   // pictures of GL methods compared with another method's of the same seed and samples
    int pictures_different = 0;  // number of compared pictures that differ in any bit
};

/// Returns the stage that a pass belongs to: 0 camera rays and film, 1 direct light, 2 indirect light.
std::size_t stage_of(std::string_view pass);

struct MeasureHooks {
    Pulse pulse;
    std::function<void(double)> progress;
};
/// Runs the plan with one painter per method. Each painter first makes a picture that is not measured. Keeps the
/// pictures of all seeds in memory.
Measurement measure(const Plan& plan, const std::vector<std::unique_ptr<Painter>>& painters, const Reference& reference,
                    Clock clock, const MeasureHooks& hooks);

/// Returns value and half width, with two digits of the half width: "(2.31 ± 0.12)·10⁻⁴".
std::string text(const Interval& interval);
/// Returns whether the slope has at least two points and a finite interval.
bool is_known(const Slope& slope);
std::string text(const Slope& slope);  ///< Returns "none" for an unknown slope.
/// Returns whether both renderers agree, in a sentence.
std::string verdict_text(const MethodAgreement& found, const std::vector<MethodResult>& methods);
/// Returns the reasons of the verdict. They are the difference of the mean, the number of blocks that differ too much,
/// the chi-square test, and the part of the external renderer's MSE that is squared difference.
std::string reasons_text(const MethodAgreement& found, const std::vector<MethodResult>& methods);

/// Returns the member of Point that methods are compared by: the mse or the variance, of all pixels or off edges.
inline Interval Point::*error_of(bool by_variance, bool off_edges) {
    return by_variance ? off_edges ? &Point::off_edges_variance : &Point::variance
           : off_edges ? &Point::off_edges_mse
                       : &Point::mse;
}

/// Returns the seconds until a method's error stays at or below `wanted`, interpolated between budgets as in the plot.
/// These are the first budget's seconds if its error is low enough, and infinity if the last one's is not.
double seconds_until(const MethodResult& method, double wanted, Clock clock, Interval Point::*error = &Point::mse);

/// seconds_until() and its interval of kConfidence. The ends may be infinite.
struct TimeToError {
    double seconds = 0, lower = 0, upper = 0;
};
/// Returns the time until a method's error stays at or below that of another method, `wanted`. The interval follows
/// from the scatter of both errors over seeds, which are independent; the scatter of times is not part of it. With one
/// seed, its ends are the first budget's seconds and infinity.
TimeToError time_to_error(const MethodResult& method, const Interval& wanted, Clock clock,
                          Interval Point::*error = &Point::mse);

/// Returns the findings about a method, whose slopes, points and picture must be set.
std::vector<Finding> findings_of(const MethodResult& method);

}  // namespace halflight::converge
