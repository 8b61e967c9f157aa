#include "tools/converge/measure.h"

#include <algorithm>
#include <cmath>

#include "engine/core/image_tools.h"
#include "engine/core/seed_errors.h"

namespace halflight::converge {
namespace {

constexpr std::size_t kStages = 3;
constexpr const char* kStageNames[kStages] = {"camera rays and film", "direct light", "indirect light"};
constexpr std::size_t kStageOfComponent[kComponents.size()] = {0, 1, 1, 2, 2};  // by kComponents

/// Pictures of one method and budget, by repeat; methods whose pictures are the same share them.
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

double by(Clock clock, const Seconds& seconds) {
    return clock == Clock::wall ? seconds.wall : seconds.cpu;
}

/// `runs`: those of the point, by repeat; their squared errors are set.
Point point_of(const std::vector<RunResult*>& runs, const std::vector<Image>& images, const Reference& reference,
               const Image& relative) {
    const auto& [half0, half1] = reference.halves;
    const auto mean = [&](const auto& value) {
        double sum = 0;
        for (const RunResult* run : runs) sum += value(*run);
        return sum / static_cast<double>(runs.size());
    };
    const SeedErrors errors = seed_errors(images, half0.beauty, half1.beauty);
    const SeedErrors relative_errors = seed_errors(images, half0.beauty, half1.beauty, relative);
    std::vector<double> flips;
    for (std::size_t k = 0; k < runs.size(); ++k) {
        runs[k]->mse = errors.of_render[k];
        runs[k]->relative_mse = relative_errors.of_render[k];
        flips.push_back(runs[k]->errors.flip);
    }
    Point point;
    point.samples = mean([](const RunResult& r) { return r.samples; });
    point.time = {mean([](const RunResult& r) { return r.time.wall; }),
                  mean([](const RunResult& r) { return r.time.cpu; })};
    point.mse = errors.mse;
    point.relative_mse = relative_errors.mse;
    point.flip = mean_interval(flips);
    point.bias_squared = errors.squared_bias;
    point.variance = errors.variance;
    point.relative_bias = relative_bias(images, reference);
    point.reference_variance = errors.reference_variance;
    point.trimmed_mse = mean([](const RunResult& r) { return r.errors.trimmed_mse; });
    point.worst_share = errors.worst_share;
    for (std::size_t c = 0; c < kComponents.size(); ++c)
        point.components[c] = mean([&](const RunResult& r) { return r.errors.components[c]; });
    return point;
}

/// y(p) adds value and standard error to a point.
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
        // As wide at 95 % as Student's interval, or the normal weights would trust few seeds too much.
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
    method.efficiency = last.mse.value > 0 ? 1 / (last.mse.value * time(last)) : 0;
}

std::vector<Stage> stages_of(const std::vector<PassTime>& passes, const Point& point) {
    std::vector<Stage> stages;
    for (const char* stage_name : kStageNames) stages.push_back({.name = stage_name});
    double seconds = 0, error = 0;
    for (const PassTime& pass : passes) {
        stages[stage_of(pass.name)].seconds += pass.seconds;
        seconds += pass.seconds;
    }
    for (std::size_t c = 0; c < kComponents.size(); ++c) {
        const double part = std::max(point.components[c], 0.0);  // an estimate of nothing may be negative
        stages[kStageOfComponent[c]].error_share += part;
        error += part;
    }
    for (Stage& stage : stages) {
        stage.time_share = seconds > 0 ? stage.seconds / seconds : 0;
        stage.error_share = error > 0 ? stage.error_share / error : 0;
        stage.gain = 1 / ((1 - stage.error_share / 2) * (1 + stage.time_share));
    }
    return stages;
}

}  // namespace

std::size_t stage_of(std::string_view pass) {
    if (pass.starts_with("shadow")) return 1;
    for (const char* indirect : {"diffuse", "glossy", "continuation", "later shadow", "connection"})
        if (pass.starts_with(indirect)) return 2;
    return 0;
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
    constexpr int kWarmUp = 4;  // samples: all programs are compiled, and have been run once
    for (const auto& painter : painters) painter->paint({.samples = kWarmUp}, 0, hooks.pulse);

    Measurement result;
    const std::size_t methods = plan.methods.size(), budgets = plan.budgets.size();
    std::vector<std::vector<Pictures>> pictures(methods, std::vector<Pictures>(budgets));
    for (std::size_t i = 0; i < runs.size(); ++i) {
        const Run& run = runs[i];
        const auto m = static_cast<std::size_t>(run.method), b = static_cast<std::size_t>(run.budget);
        Painted painted = painters[m]->paint(plan.budgets[b], run.seed, hooks.pulse);
        result.runs.push_back({run, painted.picture.samples, painted.time, 0, 0, {}, painted.picture.non_finite});
        RunResult& made = result.runs.back();

        // The pictures of a turn follow each other.
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

    const Image relative = relative_weights(reference.mean.beauty);
    for (std::size_t m = 0; m < methods; ++m) {
        MethodResult& method = result.methods.emplace_back();
        method.name = plan.method_name(m);
        method.preparation = painters[m]->preparation();
        for (std::size_t b = 0; b < budgets; ++b) {
            std::vector<RunResult*> of_point;
            for (RunResult& run : result.runs)
                if (run.run.method == static_cast<int>(m) && run.run.budget == static_cast<int>(b))
                    of_point.push_back(&run);
            const std::vector<Image> images = images_of(pictures[m][b]);
            method.points.push_back(point_of(of_point, images, reference, relative));
            if (b + 1 == budgets) {
                method.picture = images.front();
                method.mean = mean_image(images);
            }
            hooks.pulse();
        }
        method.passes = painters[m]->passes(plan.budgets.back(), runs.back().seed, hooks.pulse);
        if (reference.has_components && !method.passes.empty())
            method.stages = stages_of(method.passes, method.points.back());
        fit(method, clock);
        method.findings = findings_of(method);
    }
    return result;
}

}  // namespace halflight::converge
