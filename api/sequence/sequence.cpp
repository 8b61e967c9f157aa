#include "api/halflight/sequence.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <map>
#include <set>
#include <system_error>
#include <utility>

#include "api/halflight/frame_names.h"
#include "api/halflight/movie.h"
#include "api/sequence/frame_files.h"
#include "api/sequence/frame_queue.h"
#include "api/sequence/noisy_file.h"
#include "api/sequence/statistics_file.h"
#include "engine/core/error.h"
#include "engine/io/file_claims.h"
#include "engine/io/file_kind.h"
#include "engine/io/files.h"
#include "renderer/checkpoint.h"

namespace halflight {
namespace {

using Paths = std::vector<std::filesystem::path>;

/// Returns whether frames are needed through the view transform.
bool wants_view(const SequenceOptions& o) {
    return o.movie || std::ranges::any_of(o.outputs, [&](const auto& path) { return holds_view(path, o.output.tiff); });
}

/// A callback has stopped the look at the frames that are there.
struct StoppedBefore {
    FrameNumber frame;
    std::size_t kept;  // number of whole frames before it
};

/// Returns the frames to make, in order. They include frames that the movie cannot show because they have no .png.
/// Throws Error for files that must not be replaced, and StoppedBefore. `frames`: frames of the part.
std::vector<FrameNumber> frames_to_make(const SequenceOptions& o, const std::vector<FrameNumber>& frames, bool temporal,
                                        const FrameFiles& files, const SequenceEvents& events, const Log& log) {
    std::vector<FrameNumber> todo, damaged;
    const bool shown = !o.movie || wants(o, "png");
    std::vector<FrameNumber> rendered;  // frames that cannot be developed
    std::size_t seen = 0;
    for (const FrameNumber frame : frames) {
        if (events.go_on && !events.go_on()) throw StoppedBefore{frame, seen - todo.size()};
        ++seen;
        const FrameFiles::State state = files.examine(frame);
        if (state.other && !o.overwrite)
            throw Error(state.other->string(),
                        "exists, but is not this frame of this scene with these settings{} and this version: {}. "
                        "Nothing was rendered; --overwrite replaces it",
                        temporal ? ", these --frames (on which --preview temporal depends)" : "", state.why);
        if (state.damaged) damaged.push_back(frame);
        if (!state.whole || !shown) todo.push_back(frame);
        if ((!state.whole || !shown) && !files.developable(frame)) rendered.push_back(frame);
    }
    if (o.develop && !rendered.empty())
        throw Error(main_name(o),
                    "{}: no complete .exr of this scene with these settings, from which --develop makes "
                    "pictures",
                    frames_of_all(rendered, o.frames.size(), o.part));
    if (temporal && !rendered.empty() && rendered.size() < frames.size()) {
        log.note("--preview temporal: frames depend on earlier ones, and all are made again");
        return frames;
    }
    if (!damaged.empty()) log.note("damaged and made again: frames {}", frames_text(damaged));
    if (todo.size() > rendered.size())
        log.note("{} frames are developed from their .exr, and not rendered", todo.size() - rendered.size());
    return todo;
}

/// Returns the settings of frames of a sequence.
RenderSettings of_sequence(RenderSettings settings, const LoadedScene& scene) {
    if (!settings.bounces) settings.bounces = default_bounces(scene.scene());
    if (!settings.denoise_frames)
        settings.denoise_frames = has_halves(settings) && !has_window(settings) ? kDenoiseFrames : 0;
    return settings;
}

/// Throws Error if the sequence would write a file that the scene reads.
void check_scene_files(const LoadedScene& scene, const SequenceOptions& o) {
    std::map<std::filesystem::path, Paths> read;  // by name, since a sequence may have a million files
    for (const auto& file : scene.files()) read[file.path.filename()].push_back(file.path);
    const auto check = [&](const std::filesystem::path& path) {
        const auto known = read.find(path.filename());
        if (known == read.end()) return;
        std::error_code none;  // ignored: a file that is missing is no file of the scene
        for (const auto& file : known->second)
            if (std::filesystem::equivalent(file, path, none)) throw Error(path.string(), "is a file of the scene");
    };
    for (const FrameNumber frame : part_of(o.frames, o.part))
        for (const auto& path : pictures_of(o, frame)) check(path);
    if (o.movie) check(*o.movie);
    if (o.stats) check(*o.stats);
}

}  // namespace

void check_outputs(const SequenceOptions& o) {
    if (o.outputs.empty() && !o.movie) throw Error("sequence", "has neither outputs nor a movie");
    std::set<std::filesystem::path> patterns;
    for (const auto& pattern : o.outputs) {
        const int placeholders = count_placeholders(pattern);
        if (placeholders == 0)
            throw Error(pattern.string(), "has no placeholder for the frame number, such as #### or %04d");
        if (placeholders > 1) throw Error(pattern.string(), "has {} placeholders for the frame number", placeholders);
        check_not_noisy(pattern);
        if (!is_picture_name(pattern)) throw Error(pattern.string(), "frames are {} files", picture_extensions());
        if (!patterns.insert(pattern).second) throw Error(pattern.string(), "is given twice");
    }
    Paths files;
    for (const FrameNumber frame : part_of(o.frames, o.part))
        for (auto& path : pictures_of(o, frame)) files.push_back(std::move(path));
    if (o.movie) files.push_back(*o.movie);
    for (const auto& pattern : o.outputs) make_folder_of(pattern);
    if (o.movie) make_folder_of(*o.movie);
    if (o.stats) make_folder_of(*o.stats);
    remove_abandoned(files);
    for (const auto& pattern : o.outputs) {
        try {
            check_writable(pattern.parent_path() / fmt::format(".halflight-{}-probe", getpid()));
        } catch (const Error&) {
            check_writable(pattern);  // its message has the pattern that the user gave
            throw;
        }
    }
    if (!o.stats) return;
    check_writable(*o.stats);
    check_takes_text(*o.stats);
}

std::vector<FrameNumber> incomplete_frames(const LoadedScene& scene, const RenderSettings& settings,
                                           const Shutter& shutter, const ColorConfig& colors, const SequenceOptions& o,
                                           const std::function<void()>& look) {
    RenderSettings own = of_sequence(settings, scene);
    own.want_view = wants_view(o);
    const FrameFiles files(scene, own, shutter, colors, o);
    std::vector<FrameNumber> bad;
    for (const FrameNumber frame : part_of(o.frames, o.part)) {
        look();
        if (!files.is_whole(frame)) bad.push_back(frame);
    }
    return bad;
}

SequenceTally render_sequence(LoadedScene& scene, const RenderSettings& asked, const RendererOptions& renderer,
                              const SequenceOptions& o, const SequenceEvents& events, const Log& log) {
    check_outputs(o);
    check_scene_files(scene, o);
    RendererOptions options = renderer;
    options.exr_tile = o.output.exr.tile;
    if (o.checkpoint && o.outputs.empty())
        throw Error(o.movie->string(),
                    "a movie without files of frames begins anew after a stop: it has no checkpoints");
    if (asked.keep_noisy && o.outputs.empty())
        throw Error(o.movie->string(), "a movie without files of frames keeps no noisy frames");
    if (o.checkpoint)
        options.frame_checkpoints = {[&o, own = std::set<FrameNumber>()](FrameNumber frame) mutable {
                                         if (own.empty())
                                             for (const FrameNumber f : part_of(o.frames, o.part)) own.insert(f);
                                         return own.contains(frame) ? std::optional(checkpoint_folder(o, frame))
                                                                    : std::nullopt;
                                     },
                                     *o.checkpoint, o.overwrite};
    if (!options.colors) options.colors = ColorConfig::load();
    if (o.movie && asked.transparent) throw Error(o.movie->string(), "a movie cannot be transparent");
    RenderSettings settings = of_sequence(asked, scene);
    for (const auto& pattern : o.outputs) {
        check_alpha(pattern, asked.transparent);
        check_size(pattern, data_window(asked).size());
    }
    settings.want_view = wants_view(o);
    settings.measure = o.stats.has_value();
    working_space(*options.colors, o.output.working_space);  // throws for unknown names
    std::optional<DisplayEncoding> encoding;
    if (settings.want_view) encoding = options.colors->view(settings.view).encoding();
    for (const auto& pattern : o.outputs) check_encoding(pattern, o.output.tiff, encoding);
    const std::vector<FrameNumber> frames = part_of(o.frames, o.part);
    const FrameFiles files(scene, settings, options.shutter, *options.colors, o);
    remove_abandoned(files.noisy_names());
    std::vector<FrameNumber> todo;
    try {
        todo = frames_to_make(o, frames, settings.preview.temporal, files, events, log);
    } catch (const StoppedBefore& stopped) {
        return {.frames = frames.size(), .kept = stopped.kept, .stopped_in = stopped.frame};
    }
    if (const std::optional<double> end = scene.animation_end(); end && !frames.empty())
        if (const FrameNumber last = *std::ranges::max_element(frames); scene.time_of(last - 1.0) > *end)
            log.warn("frames up to {} are beyond the end of the animation, {:g} s: they show its last pose", last,
                     *end);
    if (scene.animation_end() && !frames.empty() && *std::ranges::min_element(frames) < scene.choice().frame_offset)
        log.warn("frames before {}, which is at 0 s, show the first pose", scene.choice().frame_offset);
    settings.pictures = static_cast<int>(todo.size()) * (1 + 2 * neighbour_frames(settings));
    if (o.stats) append_line(*o.stats, "");

    SequenceTally tally{.frames = frames.size(), .kept = frames.size() - todo.size()};
    if (tally.kept > 0) log.note("{} of {} frames are there already", tally.kept, frames.size());
    // Runs that were killed may have left some, which whole frames do not need.
    const auto discard_checkpoints = [&] {
        for (const FrameNumber frame : frames) Checkpoint::discard(checkpoint_folder(o, frame));
    };
    if (todo.empty() && !o.movie) {
        discard_checkpoints();
        files.discard_exchanged(frames, {});
        const FileClaims abandoned(o.outputs[0]);  // a process may have been killed after the last frame
        return tally;
    }
    if (events.started) events.started(todo.size());
    const auto make = [&](Movie* movie) {
        std::optional<FrameMaker> maker;
        std::optional<FileClaims> claims;
        if (!o.outputs.empty() && !settings.preview.temporal) claims.emplace(o.outputs[0]);
        FileClaims* const shared = claims ? &*claims : nullptr;
        if (!todo.empty()) maker.emplace(scene, settings, options, o, events, log, files, shared);
        FrameQueue queue(o, events, log, files, shared);
        queue.make(frames, todo, maker ? &*maker : nullptr, movie, tally);
        maker.reset();
        discard_checkpoints();
    };
    try {
        if (o.movie) {
            const MovieFormat format{.size = data_window(settings).size(),
                                     .rate = scene.frame_rate(),
                                     .bits = png_bits(o.output, encoding),
                                     .encoding = encoding,
                                     .start = time_code(scene.frame_rate(), frames.empty() ? 0 : frames.front())};
            write_atomically(*o.movie, [&](const std::filesystem::path& temporary) {
                Movie movie(temporary, o.movie->string(), format, [&] {
                    if (events.go_on && !events.go_on()) throw Stopped();
                });
                make(&movie);
                if (!frames.empty()) tally.stopped_in = frames.back();
                movie.finish();
                tally.stopped_in.reset();
            });
        } else {
            make(nullptr);
        }
    } catch (const Stopped&) {
    }
    return tally;
}

}  // namespace halflight
