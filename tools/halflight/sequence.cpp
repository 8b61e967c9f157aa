#include "tools/halflight/sequence.h"

#include <fmt/format.h>

#include "api/halflight/sequence.h"
#include "engine/core/stopwatch.h"
#include "tools/cli/console.h"
#include "tools/cli/signals.h"
#include "tools/halflight/progress.h"
#include "tools/halflight/render_options.h"
#include "tools/halflight/render_parts.h"

namespace halflight {
namespace {

std::string counted(std::size_t frames) {
    return fmt::format("{} frame{}", frames, frames == 1 ? "" : "s");
}

}  // namespace

void run_sequence(const RenderArguments& a, Watched* watched) {
    const Console console(a.log.level);
    const std::size_t frames = part_of(a.frames, a.part).size();
    if (frames == 0) {
        console.note("there are fewer frames than parts: none in part {} of {}", a.part.number, a.part.of);
        return;
    }
    const SequenceOptions options{.frames = a.frames,
                                  .part = a.part,
                                  .outputs = a.outputs,
                                  .movie = a.movie,
                                  .stats = a.stats,
                                  .overwrite = a.overwrite,
                                  .accept_sources = a.accept_sources,
                                  .develop = a.develop,
                                  .checkpoint = a.checkpoint,
                                  .output = a.output};
    if (!a.check) check_outputs(options);
    RendererOptions renderer{.device = device_options(a),
                             .context = watched ? watched->context : nullptr,
                             .colors = ColorConfig::load(a.ocio),
                             .shutter = a.shutter};
    check_color(*renderer.colors, a, console);
    LoadedScene scene = load_scene(a, console);
    check_render_files(a, scene.files());
    if (watched) watched->take(scene, *renderer.colors);
    const RenderSettings settings = make_settings(a, scene.chosen_camera().camera);
    if (a.check) {
        const auto bad = incomplete_frames(scene, settings, a.shutter, *renderer.colors, options, [&] {
            if (stop_signal() != 0) throw Interrupted(stop_signal(), a.outputs[0].string(), "interrupted");
        });
        if (!bad.empty())
            throw Error(a.outputs[0].string(), "{}: missing, damaged, or of another scene or other settings",
                        frames_of_all(bad, a.frames.size(), a.part));
        console.note("{}: all {} frames are whole", a.outputs[0].string(), frames);
        return;
    }

    Stopwatch clock;
    std::optional<SequenceDisplay> display;
    const auto goes_on = [&] { return stop_signal() == 0 && !(watched && watched->files.changed()); };
    SequenceEvents events;
    events.started = [&](std::size_t todo) {
        display.emplace(stderr, progress_form(a.log.quiet(), a.json_progress), todo, settings.time_limit);
        clock = Stopwatch();
        if (watched) watched->owns = true;  // no frame was refused
    };
    events.progress = [&](FrameNumber frame, const RenderProgress& progress) {
        display->show(frame, progress);
        return goes_on();
    };
    events.go_on = goes_on;
    events.made = [&](FrameNumber frame, std::size_t made, std::size_t failed) {
        display->made(frame, made, failed, clock.seconds());
        console.detail("frame {} written after {:.1f} s: {} made, {} failed", frame, clock.seconds(), made, failed);
    };
    events.failed = [&](FrameNumber frame, const std::string& error) {
        display->clear();
        console.detail("frame {} failed: {}", frame, error);
    };
    events.found = [&](FrameNumber frame, std::size_t found) { display->found(frame, found, clock.seconds()); };
    events.writing = [](const std::function<void()>& write) {
        const WritingFiles writing;
        write();
    };
    const SequenceTally tally = render_sequence(scene, settings, renderer, options, events, console);
    display.reset();
    const std::string name = (a.outputs.empty() ? *a.movie : a.outputs[0]).string();
    if (tally.stopped_in && stop_signal() == 0) throw FilesChanged();
    if (tally.stopped_in)
        throw Interrupted(stop_signal(), name,
                          a.outputs.empty() ? fmt::format("not written: interrupted in frame {}", *tally.stopped_in)
                                            : fmt::format("interrupted in frame {}: {} of {} frames are there",
                                                          *tally.stopped_in, tally.kept + tally.made, frames));
    if (tally.made > 0 && !a.outputs.empty())
        console.note("wrote {}: {} in {:.1f} s", name, counted(tally.made), clock.seconds());
    if (a.movie) console.note("wrote {}: {}", a.movie->string(), counted(frames));
}

}  // namespace halflight
