#include <algorithm>
#include <chrono>
#include <cmath>
#include <future>

#include "engine/gpu/program_binaries.h"
#include "engine/io/files.h"
#include "tools/halflight/camera.h"
#include "tools/halflight/commands.h"
#include "tools/halflight/loading.h"
#include "tools/halflight/picture.h"
#include "tools/halflight/progress.h"
#include "tools/halflight/signals.h"
#include "tools/halflight/statistics.h"

namespace halflight {
namespace {

constexpr int kUsualSamples = 64;
constexpr int kManySamples = 1 << 24;  // where the time decides

class Clock {
  public:
    double seconds() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count(); }
    /// Since the last lap.
    double lap() {
        const double now = seconds();
        return now - std::exchange(lap_, now);
    }

  private:
    std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
    double lap_ = 0;
};

bool wants(const RenderArguments& a, std::string_view extension) {
    return std::ranges::any_of(a.outputs, [&](const auto& path) { return has_extension(path, extension); });
}

/// Everything that can be told before the long work.
void check_outputs(const RenderArguments& a) {
    for (const auto& path : a.outputs) check_writable(path);
    if (a.stats) check_writable(*a.stats);
    if (a.graph) check_writable(*a.graph);
}

LinearSpace working_space(const ColorConfig& config, const std::string& name) {
    return config.linear_space(name == "rec709" ? "" : name);
}

RenderSettings make_settings(const RenderArguments& a, const Camera& camera) {
    const ivec2 size = picture_size(a, camera);
    RenderSettings settings;
    settings.width = size.x;
    settings.height = size.y;
    settings.camera = camera;
    settings.samples = a.samples.value_or(a.time || a.error ? kManySamples : kUsualSamples);
    settings.time_limit = a.time.value_or(0);
    if (a.error) settings.error = ErrorTarget{a.error_metric, *a.error};
    settings.bounces = a.bounces;
    settings.culling = a.culling;
    settings.keep_all = a.keep_all;
    settings.estimator = a.estimator;
    settings.pictures = 1;
    settings.seed = a.seed;
    settings.frame = a.frame;
    settings.aovs = a.aovs;
    settings.half_color = a.half;
    settings.want_view = wants(a, "png");
    settings.view = a.view;
    settings.measure = a.stats.has_value();
    return settings;
}

/// Throws if a signal asked to stop.
void stop_point(const std::filesystem::path& output, std::string_view when) {
    if (const int signal = stop_signal())
        throw Interrupted(signal, output.string(), fmt::format("not written: interrupted {}", when));
}

}  // namespace

void run_render(const RenderArguments& a) {
    Clock clock;
    StepTimes times;
    const Console console(a.quiet);

    check_outputs(a);
    const ColorConfig config = ColorConfig::load(a.ocio);
    if (wants(a, "png")) config.view(a.view);  // for its errors
    const LinearSpace space = working_space(config, a.working_space);

    // Another thread reads while this one, whose the context is to be, wakes the driver up.
    auto reading = std::async(std::launch::async, [&] {
        Scene read = load_scene(a.scene, a.allow_outside, console);
        set_environment(read, a, console);
        return read;
    });
    gpu::Context context =
        gpu::Context::create({.device = a.device,
                              .binaries_folder = a.no_shader_cache ? "" : gpu::default_binaries_folder(),
                              .debug = a.gl_debug});
    times.context = clock.lap();
    Scene scene = reading.get();
    const auto [camera, origin] = choose_camera(scene, a);
    const RenderSettings settings = make_settings(a, camera);
    times.load = clock.lap();
    stop_point(a.outputs[0], "before rendering");

    console.note("{} x {} pixels, camera {}, on {}", settings.width, settings.height, origin, context.renderer());

    Renderer renderer(context, scene, config, settings);
    RenderResult result;
    int samples_done = 0;
    {
        ProgressDisplay display(stderr, a.quiet, settings.time_limit);
        result = renderer.render([&](const RenderProgress& progress) {
            display.show(progress);
            samples_done = progress.samples_done;
            return stop_signal() == 0;
        });
    }
    context.check("rendering");
    times.render = clock.lap();
    if (result.stats.interrupted) stop_point(a.outputs[0], fmt::format("after {} samples per pixel", samples_done));
    if (const std::string bad = describe_bad_values(result.stats); !bad.empty()) {
        if (a.strict) throw Error(a.outputs[0].string(), "not written: {}", bad);
        console.warn("{}; they count as 0", bad);
    }

    std::string error;
    if (const auto& achieved = result.stats.error) {
        error = error_line(*achieved);
        if (!achieved->reached && !a.best_effort)
            throw Error(a.outputs[0].string(), "not written: after {} samples per pixel, {}; see --best-effort",
                        result.stats.samples, error);
        console.note("{}", error);
    }

    {
        const WritingFiles writing;
        const PictureInfo info{camera, space, a.half, settings_line(a, settings, scene, result.stats), error};
        for (const auto& path : a.outputs) write_picture(path, result, info);
        if (a.graph) write_file(*a.graph, renderer.graph_dot());
        times.write = clock.lap();
        times.total = clock.seconds();
        if (a.stats)
            write_file(*a.stats, run_statistics(a, settings, scene, context, result.stats, times).dump(2) + "\n");
    }
    for (const auto& path : a.outputs)
        console.note("wrote {}: {} samples per pixel in {:.1f} s", path.string(), result.stats.samples, times.total);
}

}  // namespace halflight
