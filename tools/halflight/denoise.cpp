// `halflight denoise`: its options, and the command.
#include "api/halflight/denoise.h"

#include <fmt/format.h>

#include <algorithm>

#include "api/halflight/frame_names.h"
#include "engine/core/interruption.h"
#include "engine/core/stopwatch.h"
#include "engine/gpu/driver_needs.h"
#include "tools/cli/console.h"
#include "tools/cli/options.h"
#include "tools/cli/signals.h"
#include "tools/halflight/commands.h"
#include "tools/halflight/render_options.h"
#include "tools/halflight/render_parts.h"

namespace halflight {

void add_denoise_options(CLI::App& app, DenoiseArguments& a) {
    app.add_option("FRAMES", a.noisy,
                   "noisy frames, NAME.noisy.exr, or pictures beside which they lie; with --frames, a name with a "
                   "placeholder such as shot.####.noisy.exr")
        ->type_name("");
    Options options(app);
    options.group("Files");
    options.repeated("--output,-o", "FILE",
                     "denoised pictures, .exr, .png, .jpg or .tif, with a placeholder for the frame number as in "
                     "clean.####.exr (default NAME.denoised.exr beside each noisy frame)",
                     [&](const auto& name, const auto& text) {
                         if (text.empty()) throw UsageError(name, "expects the name of a file");
                         a.outputs.emplace_back(text);
                     });
    options.value("--frames", "LIST", "frames of a name with a placeholder: 1-240, 1-240x2, -5--1,1,5,9-12",
                  [&](const auto& name, const auto& text) { a.frames = parsed(parse_frames, name, text); });
    options.value("--denoise-frames", "N",
                  "frames before and after each frame from which the denoiser takes light, too (default: as many as "
                  "the noisy frames were rendered for)",
                  [&](const auto& name, const auto& text) {
                      a.settings.denoise_frames = whole(name, text, 0, kMaxDenoiseFrames);
                  });
    options.flag("--overwrite", a.overwrite, "replaces pictures of other frames or settings");
    add_accept_sources(options, a);
    options.flag("--best-effort", a.output.best_effort,
                 "accepts frames that were rendered for an error target and have not reached it");
    options.flag("--reproducible", a.output.reproducible,
                 "writes no date into files, so that equal pictures are equal files");
    add_output_options(options, a);
    options.group("Run");
    options.flag("--strict", a.output.strict, "fails if any pass yielded a NaN, an infinity or a negative radiance");
    add_run_basics(options, a);
}

void finish_denoise_options(const CLI::App& app, DenoiseArguments& a) {
    check_leftovers(app, "halflight denoise");
    if (a.noisy.empty()) throw UsageError("FRAMES", "is missing; see halflight denoise --help");
    std::vector<std::filesystem::path> files;
    bool numbered = false;
    for (const auto& name : a.noisy) {
        const int placeholders = count_placeholders(name);
        if (placeholders > 1) throw UsageError(name.string(), "has {} placeholders for the frame number", placeholders);
        if (placeholders == 1 && a.frames.empty())
            throw UsageError(name.string(), "has a placeholder for the frame number, but --frames is missing");
        if (placeholders == 0) files.push_back(name);
        numbered = numbered || placeholders == 1;
        for (const FrameNumber frame : a.frames)
            if (placeholders == 1) files.push_back(frame_path(name, frame));
    }
    if (!a.frames.empty() && !numbered)
        throw UsageError("--frames", "needs a name with a placeholder, such as shot.####.noisy.exr");
    a.noisy = std::move(files);
    for (const auto& path : a.outputs) {
        if (!is_picture_name(path)) throw UsageError(path.string(), "an output is an {}", picture_extensions());
        if (a.noisy.size() > 1 && count_placeholders(path) == 0)
            throw UsageError(path.string(), "has no placeholder for the frame number, such as #### or %04d");
    }
    check_output_options(app, a);
}

void run_denoise(const DenoiseArguments& a) {
    gpu::prepare_process();
    const Console console(a.log.level);
    const Stopwatch watch;
    DenoiseOptions options{.frames = a.noisy,
                           .outputs = a.outputs,
                           .near = a.settings.denoise_frames,
                           .view = a.settings.view,
                           .output = a.output,
                           .overwrite = a.overwrite,
                           .accept_sources = a.accept_sources,
                           .colors = ColorConfig::load(a.ocio),
                           .device = device_options(a)};
    check_color(*options.colors, a, console);
    std::size_t done = 0;
    const Interruptible stops([&] {
        if (const int signal = stop_signal())
            throw Interrupted(signal, a.noisy[0].string(), fmt::format("interrupted after {} frames", done));
    });
    const DenoiseTally tally = denoise_frames(
        options,
        [&](std::size_t frames, std::size_t) {
            done = frames;
            interruption_point();
            return true;
        },
        console);
    if (tally.kept > 0) console.note("{} of {} frames are there already", tally.kept, tally.frames);
    if (tally.made > 0)
        console.note("denoised {} frame{} in {:.1f} s", tally.made, tally.made == 1 ? "" : "s", watch.seconds());
}

}  // namespace halflight
