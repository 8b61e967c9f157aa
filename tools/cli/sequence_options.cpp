// Options of sequences and animations.
#include <algorithm>

#include "api/halflight/frame_names.h"
#include "api/halflight/frame_renderer.h"
#include "engine/core/frames.h"
#include "tools/cli/options.h"

namespace halflight {
namespace {

void check_shutter(const CLI::App& app, const RenderArguments& a) {
    for (const char* option : {"--shutter-times", "--shutter-position", "--shutter-ramp"})
        if (app.count(option) > 0 && a.shutter.open == 0) throw UsageError(option, "needs --shutter");
    if (a.shutter.open == 0) return;
    if (a.frames.empty() && !a.choice.animation) throw UsageError("--shutter", "needs --frames or --animation");
    if (const int samples = a.settings.samples; a.shutter.times.value_or(1) > samples)
        throw UsageError("--shutter-times", "{} samples are too few for {} times", samples, *a.shutter.times);
}

void check_movie(const RenderArguments& a) {
    if (a.frames.empty()) throw UsageError("--movie", "needs --frames");
    if (!has_extension(*a.movie, "mp4") && !has_extension(*a.movie, "mov"))
        throw UsageError(a.movie->string(), "expects an .mp4 or a .mov");
    if (count_placeholders(*a.movie) > 0)
        throw UsageError(a.movie->string(), "has a placeholder for frame numbers, but a movie is one file");
}

}  // namespace

void add_animation_options(Options& options, std::optional<std::string>& animation, std::optional<FrameRate>& rate,
                           const std::string& usual) {
    options.value(
        "--fps", "N|N/D",
        "frames per second; frame N is at N/fps seconds (default: fps or frame_rate in the extras of the scene, "
        "else 24)",
        [&](const auto& name, const auto& text) { rate = parsed(parse_frame_rate, name, text); });
    options.value("--animation", "NAME|N|all|none", fmt::format("animation of the scene to play (default: {})", usual),
                  [&](const auto& name, const auto& text) {
                      if (text.empty()) throw UsageError(name, "expects a name, a number, all or none");
                      animation = text;
                  });
}

void add_shutter_option(Options& options, RenderArguments& a) {
    options.value("--shutter", "S", "motion blur: opening time of the shutter in frames, 0 to 100 (default 0)",
                  [&](const auto& name, const auto& text) { a.shutter.open = real(name, text, 0, kMostShutter); });
}

void add_accept_sources(Options& options, RenderArguments& a) {
    options.repeated("--accept-sources", "HASH",
                     "keeps frames that a program of other sources has made, as if this one had made them; HASH is the "
                     "build of its --version",
                     [&](const auto& name, const auto& text) {
                         const auto digit = [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); };
                         if (text.size() != 16 || !std::ranges::all_of(text, digit))
                             throw UsageError(name, "expects 16 hexadecimal digits, not '{}'", text);
                         a.accept_sources.push_back(text);
                     });
}

void add_sequence_options(Options& options, RenderArguments& a) {
    options.group("Sequence");
    options.value("--frames", "LIST",
                  "frames to render: 1-240, 1-240x2, 1,5,9-12; outputs need a placeholder as in shot.####.exr or "
                  "shot.%04d.exr. Complete frames of the same settings are skipped",
                  [&](const auto& name, const auto& text) { a.frames = parsed(parse_frames, name, text); });
    add_animation_options(options, a.choice.animation, a.choice.frame_rate,
                          "all with --frames, else none, the scene at rest");
    options.value("--frame-offset", "N", "number of the frame at 0 s (default 0)",
                  [&](const auto& name, const auto& text) {
                      a.choice.frame_offset = whole(name, text, -1000000000, 1000000000);
                  });
    add_shutter_option(options, a);
    options.value("--shutter-times", "N",
                  "number of moments at which the scene is posed while the shutter is open; samples share them "
                  "(default: one for each sample, or fewer if posing the scene takes long)",
                  [&](const auto& name, const auto& text) { a.shutter.times = whole(name, text, 1, kMaxSamples); });
    options.value(
        "--shutter-position", "start|centre|end",
        "place of the frame's time in the opening of the shutter (default centre)",
        [&](const auto& name, const auto& text) { a.shutter.position = parsed(parse_shutter_position, name, text); });
    options.value("--shutter-ramp", "R",
                  "share of the opening time in which the shutter opens and closes, 0 to 1 (default 0: at once)",
                  [&](const auto& name, const auto& text) { a.shutter.ramp = real(name, text, 0, 1); });
    options.path("--movie", "FILE.mp4|.mov",
                 "writes the frames as a movie through the view transform, H.264 or ProRes; needs ffmpeg in PATH",
                 a.movie);
    options.value("--turntable", "FRAMES",
                  "turns the camera once about the scene's centre, or about --look-at, in so many frames; --frames is "
                  "then all of them by default",
                  [&](const auto& name, const auto& text) { a.view.turntable = whole(name, text, 1, 1000000); });
    options.flag("--overwrite", a.overwrite,
                 "replaces frames, or a checkpoint, that were made with other settings or from another scene");
    add_accept_sources(options, a);
    options.flag("--develop", a.develop,
                 "renders nothing: makes other pictures and the movie from the .exr of each frame, also from half "
                 "floats. Without it, frames are developed whose .exr is complete and exact");
    options.value(
        "--part", "I/N",
        "renders the I-th of N parts of the frames, or of the samples of a single picture, for use on N machines",
        [&](const auto& name, const auto& text) { a.part = parsed(parse_part, name, text); });
    options.flag("--check", a.check,
                 "renders nothing; fails if a frame is missing, damaged or made with other settings");
    options.flag("--reproducible", a.output.reproducible,
                 "writes neither date nor render time into files, so that equal pictures are equal files");
}

void check_sequence_options(const CLI::App& app, const RenderArguments& a) {
    const bool sequence = !a.frames.empty();
    if (app.count("--overwrite") > 0 && !sequence && !a.checkpoint && a.part.of == 1)
        throw UsageError("--overwrite", "needs --frames, --checkpoint or --part");
    for (const char* option : {"--check", "--accept-sources"})
        if (app.count(option) > 0 && !sequence) throw UsageError(option, "needs --frames");
    if (a.develop &&
        (!sequence || std::ranges::none_of(a.outputs, [](const auto& path) { return has_extension(path, "exr"); })))
        throw UsageError("--develop", "needs --frames, and the .exr among the outputs");
    if (a.movie) check_movie(a);
    check_shutter(app, a);
    if (app.count("--fps") > 0 && !sequence && !a.choice.animation)
        throw UsageError("--fps", "needs --frames or --animation");
    for (const auto& path : a.outputs) {
        const int placeholders = count_placeholders(path);
        if (placeholders > 1) throw UsageError(path.string(), "has {} placeholders for the frame number", placeholders);
        if (sequence && placeholders == 0)
            throw UsageError(path.string(), "has no placeholder for the frame number, such as #### or %04d");
        if (!sequence && placeholders == 1)
            throw UsageError(path.string(), "has a placeholder for the frame number, but --frames is missing");
    }
}

std::vector<std::filesystem::path> output_files(const RenderArguments& a) {
    if (a.frames.empty()) return a.outputs;
    std::vector<std::filesystem::path> files;
    for (const auto& pattern : a.outputs) {
        if (count_placeholders(pattern) == 0) {  // check_sequence_options() refuses it later
            files.push_back(pattern);
            continue;
        }
        for (const FrameNumber frame : a.frames) files.push_back(frame_path(pattern, frame));
    }
    return files;
}

}  // namespace halflight
