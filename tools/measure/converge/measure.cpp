#include "tools/measure/converge/measure.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include "engine/core/image_tools.h"
#include "tools/measure/common/seed_errors.h"

namespace halflight::converge {
namespace {

constexpr std::size_t kStages = 3;
constexpr const char* kStageNames[kStages] = {"camera rays and film", "direct light", "indirect light"};
constexpr std::size_t kStageOfComponent[kComponents.size()] = {0, 1, 1, 2, 2};  // stage by component

constexpr Interval kUnknown{std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()};

/// Pictures of one method and budget, by repeat; methods that make the same pictures share them.
using Pictures = std::vector<std::shared_ptr<const Image>>;

std::vector<Image> images_of(const Pictures& pictures) {
    std::vector<Image> images;
    for (const auto& picture : pictures) images.push_back(*picture);
    return images;
}

Image mean_image(const std::vector<Image>& images) {
    Image mean = images.front();
    for (std::size_t i = 0; i < mean.pixels.size(); ++i) {
        double sum = 0;
        for (const Image& image : images) sum += image.pixels[i];
        mean.pixels[i] = static_cast<float>(sum / static_cast<double>(images.size()));
    }
    return mean;
}

/// Returns the statistics of one method and budget. Sets the squared errors of its `runs`, which are sorted by repeat.
Point point_of(const std::vector<RunResult*>& runs, const std::vector<Image>& images, Clock clock,
               const Reference& reference, const Image& relative, const Image& off_edges,
               const std::array<Image, 2>& blurred_halves) {
    const auto& [half0, half1] = reference.halves;
    const auto mean = [&](const auto& value) {
        double sum = 0;
        for (const RunResult* run : runs) sum += value(*run);
        return sum / static_cast<double>(runs.size());
    };
    const SeedErrors errors = seed_errors(images, half0.beauty, half1.beauty);
    const SeedErrors relative_errors = seed_errors(images, half0.beauty, half1.beauty, relative);
    std::vector<Image> blurred;
    for (const Image& image : images) blurred.push_back(box_blur(image, kBlurRadius));
    const SeedErrors blurred_errors = seed_errors(blurred, blurred_halves[0], blurred_halves[1]);
    std::vector<double> flips, rates;
    for (std::size_t k = 0; k < runs.size(); ++k) {
        runs[k]->mse = errors.of_render[k];
        runs[k]->relative_mse = relative_errors.of_render[k];
        runs[k]->blurred_mse = blurred_errors.of_render[k];
        flips.push_back(runs[k]->errors.flip);
        rates.push_back(1.0 * images[k].width * images[k].height * runs[k]->samples / by(clock, runs[k]->time));
    }
    Point point;
    point.samples = mean([](const RunResult& r) { return r.samples; });
    point.time = {mean([](const RunResult& r) { return r.time.wall; }),
                  mean([](const RunResult& r) { return r.time.cpu; })};
    point.paths_per_second = mean_interval(rates);
    point.mse = errors.mse;
    point.relative_mse = relative_errors.mse;
    point.blurred_mse = blurred_errors.mse;
    point.off_edges_mse = point.off_edges_variance = kUnknown;
    if (!off_edges.pixels.empty()) {
        const SeedErrors off = seed_errors(images, half0.beauty, half1.beauty, off_edges);
        point.off_edges_mse = off.mse, point.off_edges_variance = off.variance;
    }
    point.flip = mean_interval(flips);
    point.bias_squared = errors.squared_bias;
    point.variance = errors.variance;
    point.relative_bias = relative_bias(images, reference);
    point.reference_variance = errors.reference_variance;
    point.trimmed_mse = mean([](const RunResult& r) { return r.errors.trimmed_mse; });
    point.worst_share = errors.worst_share;
    point.has_components = runs.front()->errors.has_components;
    for (std::size_t c = 0; c < kComponents.size(); ++c)
        point.components[c] = mean([&](const RunResult& r) { return r.errors.components[c]; });
    return point;
}

/// Fits the slope of y over x; y() adds value and standard error to a point.
template <class X, class Y>
Slope slope_of(const std::vector<Point>& points, const X& x, const Y& y) {
    std::vector<CurvePoint> curve;
    for (const Point& point : points) curve.push_back(y(CurvePoint{.x = x(point)}, point));
    return fit_slope(curve);
}

void fit(MethodResult& method, Clock clock) {
    const auto time = [&](const Point& p) { return by(clock, p.time); };
    const auto mse = [&](CurvePoint c, const Point& p) {
        c.y = p.mse.value;
        // A normal distribution with this error has Student's 95 % interval, so few seeds do not weigh too much.
        c.error = std::isfinite(p.mse.half_width) ? p.mse.half_width / kNormalQuantile : 0;
        return c;
    };
    const auto trimmed = [&](CurvePoint c, const Point& p) {
        c.y = p.trimmed_mse;
        return c;
    };
    method.slope = slope_of(method.points, time, mse);
    method.slope_by_samples = slope_of(
        method.points, [](const Point& p) { return p.samples; }, mse);
    method.slope_trimmed = slope_of(method.points, time, trimmed);
    const Point& last = method.points.back();
    const auto efficiency = [&](const Interval& e) { return e.value > 0 ? 1 / (e.value * time(last)) : 0; };
    method.efficiency = efficiency(last.mse);
    method.efficiency_by_variance = efficiency(last.variance);
}

using Components = std::array<double, kComponents.size()>;

/// Returns the squared errors of each component in the runs of one method and budget.
std::vector<Components> components_of(const std::vector<RunResult>& runs, int method, int budget) {
    std::vector<Components> components;
    for (const RunResult& run : runs)
        if (run.run.method == method && run.run.budget == budget) components.push_back(run.errors.components);
    return components;
}

/// Returns the share of each stage in the mean error over all runs except number `without`.
std::array<double, kStages> error_shares(const std::vector<Components>& runs, std::size_t without) {
    std::array<double, kStages> shares{};
    double error = 0;
    for (std::size_t c = 0; c < kComponents.size(); ++c) {
        double sum = 0;
        for (std::size_t r = 0; r < runs.size(); ++r) sum += r == without ? 0 : runs[r][c];
        const double part = std::max(sum, 0.0);  // estimates near 0 may be negative
        shares[kStageOfComponent[c]] += part;
        error += part;
    }
    for (double& share : shares) share = error > 0 ? share / error : 0;
    return shares;
}

/// Sets the stages of a method, whose passes must be set.
void set_stages(MethodResult& method, const std::vector<Components>& runs) {
    std::array<double, kStages> seconds{};
    double all = 0;
    for (const PassTime& pass : method.passes) {
        seconds[stage_of(pass.name)] += pass.seconds;
        all += pass.seconds;
    }
    const auto time_share = [&](std::size_t s) { return all > 0 ? seconds[s] / all : 0; };
    const auto gain = [&](std::size_t s, const std::array<double, kStages>& error_share) {
        return 1 / ((1 - error_share[s] / 2) * (1 + time_share(s)));
    };
    const std::array<double, kStages> shares = error_shares(runs, runs.size());
    std::vector<std::array<double, kStages>> without;
    for (std::size_t r = 0; r < runs.size() && runs.size() > 1; ++r) without.push_back(error_shares(runs, r));
    const auto over_seeds = [&](const auto& statistic) {
        std::vector<double> values;
        for (const auto& left : without) values.push_back(statistic(left));
        return jackknife_interval(statistic(shares), values);
    };
    for (std::size_t s = 0; s < kStages; ++s)
        method.stages.push_back({kStageNames[s], seconds[s], time_share(s), shares[s],
                                 over_seeds([&](const auto& of) { return gain(s, of); })});
    std::array<std::size_t, kStages> order{0, 1, 2};
    std::ranges::sort(order, std::ranges::greater(), [&](std::size_t s) { return method.stages[s].gain.value; });
    method.stage_lead = over_seeds([&](const auto& of) { return gain(order[0], of) - gain(order[1], of); });
}

/// Compares the external renderer's pictures of the largest budget with those of each distinct method.
std::vector<MethodAgreement> agreements(const Plan& plan, const std::vector<std::vector<Pictures>>& pictures) {
    const auto external =
        static_cast<std::size_t>(std::ranges::find(plan.methods, Method::external) - plan.methods.begin());
    std::vector<MethodAgreement> all;
    for (std::size_t m = 0; m < plan.methods.size() && external < plan.methods.size() && plan.seeds > 1; ++m) {
        const auto same = [&](const MethodAgreement& other) { return plan.same_pictures(m, other.method); };
        if (m == external || std::ranges::any_of(all, same)) continue;
        all.push_back(
            {m, external, compare_pictures(images_of(pictures[m].back()), images_of(pictures[external].back()))});
    }
    return all;
}

/// Returns whether differences between programs are part of the errors: the external renderer does not agree with a
/// method, or a difference from the reference shows in an MSE. Methods that are biased on request have their own
/// differences, and count only if all methods are biased.
bool differences_count(const Measurement& measured) {
    const auto fails = [](const MethodAgreement& a) { return a.agreement.verdict() != Verdict::agree; };
    const auto biased = [&](const MethodAgreement& a) { return measured.methods[a.method].biased; };
    const bool all = std::ranges::all_of(measured.agreements, biased);
    return !measured.agreements.empty() &&
           (std::ranges::any_of(measured.agreements,
                                [&](const MethodAgreement& a) { return (all || !biased(a)) && fails(a); }) ||
            std::ranges::any_of(measured.methods, [](const MethodResult& m) {
                return !m.own_reference && m.points.back().bias_squared.lower() > 0;
            }));
}

}  // namespace

std::size_t stage_of(std::string_view pass) {
    if (pass.starts_with("shadow")) return 1;
    for (const char* indirect :
         {"diffuse", "glossy", "continuation", "later shadow", "connection", "reuse", "radiance cache"})
        if (pass.starts_with(indirect)) return 2;
    return 0;
}

namespace {

/// Returns the seconds until `errors`, those of the method's budgets, stay at or below `wanted`.
double seconds_until(const MethodResult& method, const std::vector<double>& errors, double wanted, Clock clock) {
    const std::vector<Point>& points = method.points;
    // The search starts at the back, since a noisy curve may fall below and rise again.
    std::size_t i = points.size();
    while (i > 0 && errors[i - 1] <= wanted) --i;
    if (i == points.size()) return std::numeric_limits<double>::infinity();
    const double t1 = by(clock, points[i].time);
    if (i == 0) return t1;
    const double before = errors[i - 1], after = errors[i], t0 = by(clock, points[i - 1].time);
    if (!(after > 0) || std::isinf(before)) return t1;
    return t0 * std::pow(t1 / t0, std::log(before / wanted) / std::log(before / after));
}

std::vector<double> errors_of(const MethodResult& method, Interval Point::*error,
                              const std::function<double(const Interval&)>& bound) {
    std::vector<double> errors;
    for (const Point& p : method.points) errors.push_back(bound(p.*error));
    return errors;
}

}  // namespace

double seconds_until(const MethodResult& method, double wanted, Clock clock, Interval Point::*error) {
    return seconds_until(method, errors_of(method, error, [](const Interval& e) { return e.value; }), wanted, clock);
}

TimeToError time_to_error(const MethodResult& method, const Interval& wanted, Clock clock, Interval Point::*error) {
    // The ratio of both errors decides. Its logarithm has the sum of their relative variances.
    const auto seconds = [&](double sign) {
        const auto bound = [&](const Interval& e) {
            if (!(e.value > 0)) return e.value;
            return e.value * std::exp(sign * std::hypot(e.half_width / e.value, wanted.half_width / wanted.value));
        };
        return seconds_until(method, errors_of(method, error, bound), wanted.value, clock);
    };
    return {seconds_until(method, wanted.value, clock, error), seconds(-1), seconds(1)};
}

Measurement measure(const Plan& plan, const std::vector<std::unique_ptr<Painter>>& painters, const Reference& reference,
                    Clock clock, const MeasureHooks& hooks) {
    const std::vector<Run> runs = runs_of(plan);
    const auto cost = [&](int budget) {
        const Budget& b = plan.budgets[static_cast<std::size_t>(budget)];
        return b.seconds > 0 ? b.seconds : b.samples;
    };
    double all = 0, done = 0;
    for (const Run& run : runs) all += cost(run.budget);
    constexpr int kWarmUp = 4;  // samples, after which all programs have been compiled and have run once
    for (const auto& painter : painters) painter->paint({.samples = kWarmUp}, 0, hooks.pulse);

    Measurement result;
    const std::size_t methods = plan.methods.size(), budgets = plan.budgets.size();
    std::vector<std::vector<Pictures>> pictures(methods, std::vector<Pictures>(budgets));
    for (std::size_t i = 0; i < runs.size(); ++i) {
        const Run& run = runs[i];
        const auto m = static_cast<std::size_t>(run.method), b = static_cast<std::size_t>(run.budget);
        Painted painted = painters[m]->paint(plan.budgets[b], run.seed, hooks.pulse);
        result.runs.push_back({run, painted.picture.samples, painted.time, 0, 0, 0, {}, painted.picture.non_finite});
        RunResult& made = result.runs.back();

        // Pictures of one turn are consecutive.
        const std::size_t turn = i / methods * methods;
        const auto like = std::find_if(
            result.runs.begin() + static_cast<std::ptrdiff_t>(turn), result.runs.end() - 1, [&](const RunResult& r) {
                return plan.same_pictures(m, static_cast<std::size_t>(r.run.method)) && r.samples == made.samples;
            });
        std::shared_ptr<const Image> picture;
        if (like != result.runs.end() - 1) {
            const auto& other = pictures[static_cast<std::size_t>(like->run.method)][b].back();
            ++result.pictures_compared;
            if (same_bits(*other, painted.picture.beauty))
                picture = other, made.errors = like->errors;
            else
                ++result.pictures_different;
        }
        if (!picture) {
            made.errors = run_errors(painted.picture, reference);
            picture = std::make_shared<Image>(std::move(painted.picture.beauty));
        }
        pictures[m][b].push_back(picture);
        hooks.progress((done += cost(run.budget)) / all);
    }

    const Image relative = relative_weights(reference.mean.beauty), off_edges = weights_off_edges(reference);
    const auto& halves = reference.halves;
    const std::array blurred_halves{box_blur(halves[0].beauty, kBlurRadius), box_blur(halves[1].beauty, kBlurRadius)};
    for (std::size_t m = 0; m < methods; ++m) {
        MethodResult& method = result.methods.emplace_back();
        method.name = plan.method_name(m);
        method.own_reference = plan.methods[m] != Method::external && reference.samples > 0;
        method.biased = plan.is_biased(m);
        method.preparation = painters[m]->preparation();
        for (std::size_t b = 0; b < budgets; ++b) {
            std::vector<RunResult*> of_point;
            for (RunResult& run : result.runs)
                if (run.run.method == static_cast<int>(m) && run.run.budget == static_cast<int>(b))
                    of_point.push_back(&run);
            const std::vector<Image> images = images_of(pictures[m][b]);
            method.points.push_back(point_of(of_point, images, clock, reference, relative, off_edges, blurred_halves));
            if (b + 1 == budgets) {
                method.picture = images.front();
                method.mean = mean_image(images);
            }
            hooks.pulse();
        }
        method.passes = painters[m]->passes(plan.budgets.back(), runs.back().seed, hooks.pulse);
        if (method.points.back().has_components && !method.passes.empty())
            set_stages(method, components_of(result.runs, static_cast<int>(m), static_cast<int>(budgets) - 1));
        fit(method, clock);
        method.findings = findings_of(method);
    }
    result.agreements = agreements(plan, pictures);
    result.by_variance = differences_count(result);
    return result;
}

}  // namespace halflight::converge
