#include <future>

#include "engine/gpu/program_binaries.h"
#include "engine/io/files.h"
#include "tools/halflight/animated_scene.h"
#include "tools/halflight/commands.h"
#include "tools/halflight/frame_renderer.h"
#include "tools/halflight/progress.h"
#include "tools/halflight/render_parts.h"
#include "tools/halflight/sequence.h"
#include "tools/halflight/signals.h"
#include "tools/halflight/statistics.h"

namespace halflight {
namespace {

/// Everything that can be told before the long work.
void check_outputs(const RenderArguments& a) {
    std::vector<std::filesystem::path> files = a.outputs;
    if (a.stats) files.push_back(*a.stats);
    if (a.graph) files.push_back(*a.graph);
    remove_abandoned(files);
    for (const auto& path : files) check_writable(path);
}

/// Throws if a signal asked to stop.
void stop_point(const std::filesystem::path& output, std::string_view when) {
    if (const int signal = stop_signal())
        throw Interrupted(signal, output.string(), fmt::format("not written: interrupted {}", when));
}

void render_picture(const RenderArguments& a) {
    Stopwatch watch;
    StepTimes times;
    const Console console(a.quiet);

    check_outputs(a);
    const ColorConfig config = ColorConfig::load(a.ocio);
    if (wants(a, "png")) config.view(a.settings.view);  // for its errors
    const LinearSpace space = working_space(config, a);

    // Another thread reads while this one, whose context is to be, wakes the driver up.
    auto reading = std::async(std::launch::async, [&] { return AnimatedScene(a, console); });
    gpu::Context context =
        gpu::Context::create({.device = a.device,
                              .binaries_folder = a.no_shader_cache ? "" : gpu::default_binaries_folder(),
                              .debug = a.gl_debug});
    times.context = watch.lap();
    AnimatedScene animated = reading.get();
    const Scene& scene = animated.scene();
    const ChosenCamera chosen = animated.camera(animated.frame_rate().seconds(a.settings.frame));
    FrameRenderer renderer(a, animated, context, config, make_settings(a, chosen.camera));
    const RenderSettings& settings = renderer.settings();
    times.load = watch.lap();
    stop_point(a.outputs[0], "before rendering");

    console.note("{} x {} pixels, camera {}, on {}", settings.width, settings.height, chosen.origin,
                 context.renderer());

    RenderResult result;
    int samples_done = 0;
    {
        ProgressDisplay display(stderr, a.quiet, settings.time_limit);
        result = renderer.render(a.settings.frame, [&](const RenderProgress& progress) {
            display.show(progress);
            samples_done = progress.samples_done;
            return stop_signal() == 0;
        });
    }
    context.check("rendering");
    times.load += renderer.load_seconds();
    times.render = watch.lap() - renderer.load_seconds();
    if (result.stats.interrupted) stop_point(a.outputs[0], fmt::format("after {} samples per pixel", samples_done));
    for (const std::string& bias : result.stats.biases) console.note("biased: {}", bias);
    const std::string error = judge(a, result.stats, a.outputs[0], console);

    {
        const WritingFiles writing;
        const PictureInfo info = picture_info(a, settings, space, scene, result.stats, error);
        for (const auto& path : a.outputs) write_picture(path, result, info);
        if (a.graph) write_file(*a.graph, renderer.graph_dot());
        times.write = watch.lap();
        times.total = watch.seconds();
        if (a.stats)
            write_file(*a.stats, run_statistics(a, settings, scene, context, result.stats, times, renderer.deformed())
                                         .dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) +
                                     "\n");
    }
    if (leaves_open(settings.estimator)) console.note("a pilot chose {}", text(result.stats.estimator));
    for (const auto& path : a.outputs)
        console.note("wrote {}: {} samples per pixel in {:.1f} s", path.string(), result.stats.samples, times.total);
}

}  // namespace

void run_render(const RenderArguments& a) {
    a.frames.empty() ? render_picture(a) : run_sequence(a);
}

}  // namespace halflight
