// halflight-coverage: tests the error that `halflight render --error` or `--denoise-error` reports. Renders many seeds,
// and counts how often the interval contains the true error and how often the bound is above it. Both should hold for
// 95 % of the seeds.
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>

#include "engine/core/error.h"
#include "engine/core/image_tools.h"
#include "engine/core/metrics.h"
#include "engine/gpu/driver_needs.h"
#include "renderer/held_out.h"
#include "renderer/render.h"
#include "tools/common/tool_main.h"
#include "tools/measure/bench/setup.h"
#include "tools/measure/common/seed_errors.h"

namespace halflight {
namespace {

struct Arguments {
    std::vector<std::string> scenes;
    std::string size = "48x48";
    std::string metric = name(ErrorMetric::relmse);
    double error = 0.01;
    int seeds = 100;
    int reference = 16384;
    int bounces = 8;
    bool adaptive = false;
    int denoised_samples = 0;  // 0: pictures are not denoised
    int held_out = 16;         // RenderSettings::denoise_error
    std::size_t band_pixels = RenderSettings{}.band_pixels;
};

struct Tally {
    int inside = 0, below_bound = 0, below_target = 0;
    RunningMoments samples, reported, truth;
};

Tally measure(const Arguments& a, const std::string& file, gpu::Context& context) {
    const Scene scene = bench::load_lit(file);
    RenderSettings settings;
    const ivec2 size = bench::parse_size(a.size);
    settings.width = size.x, settings.height = size.y;
    settings.camera = bench::pick_camera(scene, "").camera;
    settings.bounces = a.bounces;
    settings.band_pixels = a.band_pixels;
    PreparedScene prepared(context, scene);
    Renderer even(prepared, ColorConfig::load({}), settings);
    settings.adaptive = a.adaptive;
    settings.denoise = a.denoised_samples > 0;
    settings.denoise_error = settings.denoise ? a.held_out : 0;
    Renderer renderer(prepared, ColorConfig::load({}), settings);
    FrameSettings frame = settings;

    Image halves[2];
    frame.samples = a.reference / 2;
    for (std::uint32_t half : {0u, 1u}) {
        frame.seed = static_cast<std::uint32_t>(a.seeds) + half;
        halves[half] = rgb(even.render(frame).beauty);
    }
    const ErrorMetric metric = a.metric == name(ErrorMetric::mse) ? ErrorMetric::mse : ErrorMetric::relmse;
    frame.samples = a.denoised_samples;
    if (!settings.denoise) {
        frame.error = ErrorTarget{metric, a.error};
        frame.samples = kMaxSamples;
    }
    const auto render = [&](const FrameSettings& f, const ProgressCallback& progress) {
        return renderer.render(f, progress);
    };
    Image weights;
    if (metric == ErrorMetric::relmse) {
        Image mean = halves[0];
        for (std::size_t i = 0; i < mean.pixels.size(); ++i)
            mean.pixels[i] = (halves[0].pixels[i] + halves[1].pixels[i]) / 2;
        weights = relative_weights(mean);
    }
    Tally tally;
    for (int seed = 0; seed < a.seeds; ++seed) {
        frame.seed = static_cast<std::uint32_t>(seed);
        RenderResult result = renderer.render(frame);
        if (settings.denoise) {
            static_cast<FrameSettings&>(settings) = frame;
            estimate_denoised_error(settings, result, render, {});
        }
        const std::vector<Image> picture{rgb(result.beauty)};
        const double truth = settings.denoise ? held_out_error(picture[0], halves[0], halves[1], metric).value
                                              : seed_errors(picture, halves[0], halves[1], weights).mse.value;
        const ErrorEstimate& reported =
            settings.denoise ? result.stats.denoised_error->estimate : result.stats.error->estimate;
        tally.inside += reported.lower <= truth && truth <= reported.upper;
        tally.below_bound += truth <= reported.bound;
        tally.below_target += truth <= a.error;
        tally.samples.add(static_cast<double>(result.stats.paths) / (double{1} * size.x * size.y));
        tally.reported.add(reported.value), tally.truth.add(truth);
    }
    return tally;
}

void add_options(CLI::App& app, Arguments& a) {
    app.add_option("--scene", a.scenes, "glTF files")->required();
    app.add_option("--size", a.size, "size of the pictures in pixels, WIDTHxHEIGHT")->capture_default_str();
    CLI::Option* const metric =
        app.add_option("--metric", a.metric, "metric of the error of pictures that are not denoised");
    metric->check(CLI::IsMember({"mse", "relmse"}))->capture_default_str();
    app.add_option("--error", a.error, "error target")->check(CLI::PositiveNumber)->capture_default_str();
    app.add_option("--seeds", a.seeds, "number of pictures")->check(CLI::PositiveNumber)->capture_default_str();
    app.add_option("--reference", a.reference, "samples of both references together")
        ->check(CLI::Range(2, 1 << 24))
        ->capture_default_str();
    app.add_option("--bounces", a.bounces, "reflections along a path")
        ->check(CLI::NonNegativeNumber)
        ->capture_default_str();
    app.add_option("--denoise", a.denoised_samples,
                   "denoises pictures of this number of samples, whose relmse is estimated; --error is not reached")
        ->check(CLI::Range(2, 1 << 24))
        ->excludes(metric);
    app.add_option("--held-out", a.held_out, "samples of each of the pictures from which that is estimated")
        ->check(CLI::Range(1, 1 << 24))
        ->capture_default_str();
    app.add_flag("--adaptive", a.adaptive, "samples the pictures adaptively");
    app.add_option("--band", a.band_pixels, "pixels that are rendered at once")->capture_default_str();
}

void run(const Arguments& a) {
    gpu::prepare_process();
    gpu::Context context = gpu::Context::create({});
    fmt::print(
        "{}{}, {} pixels, {} seeds. Means over the seeds, then the number of seeds whose true error is in the "
        "interval, below the bound, below the target.\n\n{:<16} {:>8} {:>10} {:>10} {:>9} {:>9} {:>9}\n",
        a.metric, a.denoised_samples > 0 ? fmt::format(" of denoised pictures") : fmt::format(" below {:g}", a.error),
        a.size, a.seeds, "scene", "samples", "reported", "true", "interval", "bound", "target");
    for (const std::string& file : a.scenes) {
        const Tally t = measure(a, file, context);
        fmt::print("{:<16} {:>8.0f} {:>10.4g} {:>10.4g} {:>9} {:>9} {:>9}\n",
                   std::filesystem::path(file).stem().string(), t.samples.mean(), t.reported.mean(), t.truth.mean(),
                   t.inside, t.below_bound, t.below_target);
        std::fflush(stdout);
    }
}

}  // namespace
}  // namespace halflight

int main(int argc, char** argv) {
    using namespace halflight;
    CLI::App app(
        "Measures how often the interval of `halflight render --error` or `--denoise-error` contains the true error.",
        "halflight-coverage");
    Arguments arguments;
    add_options(app, arguments);
    return tool_main(app, argc, argv, [&] {
        run(arguments);
        return 0;
    });
}
