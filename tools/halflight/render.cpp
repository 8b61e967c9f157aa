#include <fmt/format.h>

#include <algorithm>
#include <future>
#include <nlohmann/json.hpp>

#include "api/halflight/frame_renderer.h"
#include "api/halflight/statistics.h"
#include "api/sequence/fingerprint.h"
#include "api/sequence/noisy_files.h"
#include "engine/core/interruption.h"
#include "engine/core/steps.h"
#include "engine/core/stopwatch.h"
#include "engine/gpu/driver_needs.h"
#include "engine/io/file_kind.h"
#include "engine/io/files.h"
#include "tools/cli/console.h"
#include "tools/cli/pass_groups.h"
#include "tools/cli/signals.h"
#include "tools/halflight/all_cameras.h"
#include "tools/halflight/commands.h"
#include "tools/halflight/progress.h"
#include "tools/halflight/render_options.h"
#include "tools/halflight/render_parts.h"
#include "tools/halflight/sequence.h"
#include "tools/halflight/watch.h"

namespace halflight {
namespace {

/// Returns the picture of a frame, or the name that stands for that of another frame.
std::filesystem::path picture_of(const RenderArguments& a, FrameNumber frame) {
    const std::filesystem::path& own = a.outputs[0];
    return frame == a.settings.frame ? own : own.parent_path() / fmt::format("{}.{}.exr", own.stem().string(), frame);
}

/// Makes the folders of files that are written. Throws Error for files that cannot be written, before the long work.
void check_outputs(const RenderArguments& a) {
    for (const auto& path : a.outputs) check_not_noisy(path);
    std::vector<std::filesystem::path> files = a.outputs;
    if (a.stats) files.push_back(*a.stats);
    if (a.graph) files.push_back(*a.graph);
    for (const auto& path : files) make_folder_of(path);
    std::vector<std::filesystem::path> made = files;
    const int reach = a.settings.keep_noisy ? neighbour_frames(a.settings) : -1;
    for (FrameNumber n = a.settings.frame - reach; n <= a.settings.frame + reach; ++n)
        made.push_back(n == a.settings.frame ? noisy_path(a.outputs[0]) : near_path(picture_of(a, n)));
    remove_abandoned(made);
    for (const auto& path : files) check_writable(path);
    if (a.stats) check_takes_text(*a.stats);
    if (a.graph) check_takes_text(*a.graph);
}

/// Throws Interrupted if a signal has asked to stop.
void stop_point(const std::filesystem::path& output, std::string_view when) {
    if (const int signal = stop_signal())
        throw Interrupted(signal, output.string(), fmt::format("not written: interrupted {}", when));
}

/// Returns the number of the part of the samples that is rendered; 0: all samples are.
int part_of_samples(const RenderArguments& a) {
    return a.part.of > 1 ? static_cast<int>(a.part.number) : 0;
}

/// Returns the folder for the sums of a part of the samples, such as "still.exr.parts/2-of-4".
std::filesystem::path folder_of_part(const RenderArguments& a, const std::filesystem::path& output, int number) {
    return std::filesystem::path(output.string() + ".parts") / fmt::format("{}-of-{}", number, a.settings.parts);
}

/// Returns where the samples of the picture are saved; none without --checkpoint and --part.
std::optional<CheckpointOptions> checkpoint_of(const RenderArguments& a) {
    constexpr double kUsualInterval = 300;  // seconds, for parts
    if (const int part = part_of_samples(a))
        return CheckpointOptions{folder_of_part(a, a.outputs[0], part), a.checkpoint.value_or(kUsualInterval),
                                 a.overwrite, part};
    if (!a.checkpoint) return std::nullopt;
    return CheckpointOptions{a.outputs[0].string() + ".checkpoint", *a.checkpoint, a.overwrite};
}

/// Returns the folders of the parts that are merged. A part may be beside any of the outputs.
std::vector<std::filesystem::path> merged_parts(const RenderArguments& a) {
    std::vector<std::filesystem::path> folders;
    for (int number = 1; a.merge && number <= a.settings.parts; ++number) {
        const auto has_part = [&](const std::filesystem::path& output) {
            std::error_code none;
            return std::filesystem::is_directory(folder_of_part(a, output, number), none);
        };
        const auto output = std::ranges::find_if(a.outputs, has_part);
        folders.push_back(folder_of_part(a, output == a.outputs.end() ? a.outputs[0] : *output, number));
    }
    return folders;
}

/// Returns the file of the noisy frame of the picture, and of those around it; null: none is kept. renderer: the one
/// that will make the picture, which may be made later.
std::shared_ptr<NoisyFiles> noisy_files(const RenderArguments& a, const FrameRenderer* const& renderer) {
    if (!a.settings.keep_noisy || part_of_samples(a) > 0) return nullptr;
    return std::make_shared<NoisyFiles>(
        NoisyFiles::Options{.picture = [&a](FrameNumber frame) { return picture_of(a, frame); },
                            .reach = neighbour_frames(a.settings),
                            .keep = true,
                            .overwrite = true,
                            .compression = lossless(a.output.exr.compression),
                            .listed = [&a](FrameNumber frame) { return frame == a.settings.frame; },
                            .info =
                                [&](const RenderResult& result) {
                                    PictureInfo info = picture_info(*renderer, result, a.output, "");
                                    info.frame = renderer->settings().frame;
                                    return info;
                                }});
}

/// Returns the samples per pixel of the picture, or of its part.
int samples_to_render(const RenderSettings& settings, const RenderArguments& a) {
    const int part = part_of_samples(a);
    return part > 0 ? settings_of_part(settings, part, settings.adaptive).samples : settings.samples;
}

/// Returns when a signal has ended the rendering, and what becomes of the samples. height: rows of the picture.
std::string after_samples(int samples, const Checkpoint* checkpoint, int height) {
    const std::string when = fmt::format("after {} samples per pixel", samples);
    if (!checkpoint) return when;
    if (const std::string problem = checkpoint->problem(); !problem.empty())
        return fmt::format("{}, which could not be saved: {}", when, problem);
    const double saved = checkpoint->saved_samples(height);
    if (saved == 0) return when;
    return fmt::format("{}; the same command goes on from its checkpoint of {:g}", when, saved);
}

void tell_details(const RenderStats& stats, const StepTimes& times, const Console& console) {
    console.detail("seconds: {:.2f} driver, {:.2f} scene, {:.2f} shaders, {:.2f} picture, {:.2f} files", times.context,
                   times.load, stats.compile_seconds, stats.render_seconds, times.write);
    console.detail("{:.1f} MiB on the device, primary visibility {}, {}", static_cast<double>(stats.gpu_bytes) / 0x1p20,
                   name(stats.primary), text(stats.estimator));
}

/// Renders the single picture of the arguments. watched: null without --watch.
void render_picture(const RenderArguments& a, Watched* watched) {
    Stopwatch clock;
    StepTimes times;
    const Console console(a.log.level);

    check_outputs(a);
    const ColorConfig config = ColorConfig::load(a.ocio);
    check_color(config, a, console);

    gpu::check_process();  // before another thread takes from the limits
    // Another thread reads the scene while this thread, which will own the context, loads the driver.
    auto reading = std::async(std::launch::async, [&] { return load_scene(a, console); });
    const auto context =
        watched ? watched->context : std::make_shared<gpu::Context>(gpu::Context::create(device_options(a)));
    times.context = clock.lap();
    LoadedScene scene = reading.get();
    check_render_files(a, scene.files());
    if (watched) watched->take(scene, config);
    if (a.needs_surfaces && scene.scene().instances.empty())
        throw Error(a.choice.scene.string(), "has no surfaces to show");
    PoseWarnings warnings(scene);
    const ChosenCamera chosen = scene.camera(scene.time_of(a.settings.frame));
    const FrameRenderer* made = nullptr;
    const std::shared_ptr<NoisyFiles> noisy = noisy_files(a, made);
    FrameRenderer renderer(scene, make_settings(a, chosen.camera),
                           {.context = context,
                            .colors = config,
                            .shutter = a.shutter,
                            .frees_scene = !noisy,
                            .checkpoint = checkpoint_of(a),
                            .merged = merged_parts(a),
                            .noisy_files = noisy,
                            .exr_tile = a.output.exr.tile});
    made = &renderer;
    Checkpoint* const checkpoint = renderer.checkpoint();
    const RenderSettings& settings = renderer.settings();
    for (const auto& path : a.outputs) check_size(path, data_window(settings).size());
    times.load = clock.lap();
    stop_point(a.outputs[0], "before rendering");

    console.note("{} x {} pixels, camera {}, on {}", settings.width, settings.height, chosen.origin,
                 context->renderer());

    const int height = rendered_window(settings, settings.camera.optics).size().y;
    EarlierRuns earlier;
    if (checkpoint) earlier = {checkpoint->earlier_samples(height), checkpoint->earlier_seconds()};
    if (earlier.samples > 0)
        console.note("goes on after {:g} of {} samples per pixel", earlier.samples, samples_to_render(settings, a));

    RenderResult result;
    bool rendering = false;  // true: the pilots have ended
    int samples_done = 0;
    try {
        ProgressDisplay display(stderr, progress_form(a.log.quiet(), a.json_progress), settings.time_limit, earlier);
        const Interruptible stops([&] {
            stop_point(a.outputs[0], "before rendering");
            if (watched) watched->owns = true;
            if (watched && watched->files.changed()) throw FilesChanged();
        });
        const StepWatch programs([&](const char* what, int number) {
            display.show_step(what, number);
            interruption_point();
        });
        const auto go_on = [](double) {
            interruption_point();
            return true;
        };
        renderer.find_estimator(go_on);
        renderer.find_exposure(go_on);
        if (noisy) {
            noisy->set_sums(sums_fingerprint(scene, renderer.settings(), a.shutter),
                            EditPrints(scene, renderer.settings(), a.shutter));
            if (a.settings.view.metered()) noisy->set_exposure(renderer.settings().view.exposure.stops);
        }
        rendering = true;
        result = renderer.render([&](const RenderProgress& progress) {
            display.show(progress);
            samples_done = progress.samples_done;
            if (checkpoint && stop_signal()) return false;  // the sample is complete and will be saved
            interruption_point();
            return true;
        });
    } catch (const Interrupted&) {
        // The samples that were there when the signal came have been saved by now.
        if (rendering) stop_point(a.outputs[0], after_samples(samples_done, checkpoint, height));
        throw;
    }
    if (result.stats.interrupted) stop_point(a.outputs[0], after_samples(samples_done, checkpoint, height));
    const std::string problem = checkpoint ? checkpoint->problem() : "";
    const int part = part_of_samples(a);
    if (!problem.empty() && part > 0) throw Error("", problem);  // it names the file
    if (!problem.empty()) console.warn("checkpoint not saved: {}", problem);
    if (part > 0) {
        if (!checkpoint->complete(height))
            throw Error(checkpoint->folder().string(), "lacks samples of part {}; the same command renders them", part);
        console.note("wrote {}: part {} of {}, {} samples per pixel in {:.1f} s", checkpoint->folder().string(), part,
                     settings.parts, result.stats.samples, clock.seconds());
        return;
    }
    times.load += renderer.load_seconds();
    times.render = clock.lap() - renderer.load_seconds();
    warnings.tell(scene, console);
    for (const std::string& bias : result.stats.biases) console.note("biased: {}", bias);
    const auto of_preview = [](const std::string& bias) { return bias.starts_with("preview: "); };
    if (a.settings_file && std::ranges::any_of(result.stats.biases, of_preview))
        console.note("--preview none leaves out the preview modes, and makes the unbiased mean");
    const std::string error = judge(result.stats, a.output, a.outputs[0], console);

    {
        const WritingFiles writing;
        const PictureInfo info = picture_info(renderer, result, a.output, error);
        write_pictures(a.outputs, result, info, console);
        if (checkpoint) checkpoint->remove();
    }
    times.write = clock.lap();
    times.total = clock.seconds();
    note_exposure(a.settings.view, settings, scene, console);
    tell_details(result.stats, times, console);
    if (leaves_open(settings.estimator)) console.note("a pilot chose {}", text(result.stats.estimator));
    for (const auto& path : a.outputs)
        console.note("wrote {}: {} samples per pixel in {:.1f} s", path.string(), result.stats.samples, times.total);
    {
        const WritingFiles writing;
        if (a.graph)
            write_file(*a.graph,
                       has_extension(*a.graph, "txt") ? pass_table(result.stats.passes) : renderer.graph_dot());
        if (a.stats)
            write_file(*a.stats, run_statistics(renderer, result.stats, times, a.outputs)
                                         .dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) +
                                     "\n");
    }
}

/// Renders the pictures of all cameras.
void render_cameras(const RenderArguments& a, Watched* watched) {
    const std::vector<RenderArguments> cameras = arguments_by_camera(a);
    std::size_t failed = 0;
    for (const RenderArguments& one : cameras) {
        try {
            one.frames.empty() ? render_picture(one, watched) : run_sequence(one, watched);
        } catch (const UsageError&) {
            throw;
        } catch (const Interrupted&) {
            throw;
        } catch (const DiskError&) {
            throw;
        } catch (const Error& error) {
            if (cameras.size() == 1) throw;
            fail(0, error.what());  // other cameras do not depend on it
            ++failed;
        }
    }
    if (failed > 0) throw Error("--camera all", "{} of {} cameras failed", failed, cameras.size());
}

}  // namespace

void run_render(const RenderArguments& a, const std::function<RenderArguments()>& reread) {
    gpu::prepare_process();
    a.watch ? render_and_watch(a, reread, render_cameras) : render_cameras(a, nullptr);
}

}  // namespace halflight
