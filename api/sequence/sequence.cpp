#include "api/halflight/sequence.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <deque>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <system_error>
#include <thread>
#include <utility>

#include "api/halflight/frame_names.h"
#include "api/halflight/movie.h"
#include "api/halflight/statistics.h"
#include "api/sequence/fingerprint.h"
#include "engine/core/error.h"
#include "engine/core/interruption.h"
#include "engine/core/steps.h"
#include "engine/core/stopwatch.h"
#include "engine/gpu/context.h"
#include "engine/io/file_claims.h"
#include "engine/io/file_kind.h"
#include "engine/io/files.h"
#include "engine/io/png.h"
#include "renderer/checkpoint.h"

namespace halflight {
namespace {

using Paths = std::vector<std::filesystem::path>;

struct Stopped {};  // thrown when a callback stops the sequence

bool wants(const SequenceOptions& o, std::string_view extension) {
    return std::ranges::any_of(o.outputs, [&](const auto& path) { return has_extension(path, extension); });
}

/// Returns whether frames are needed through the view transform.
bool wants_view(const SequenceOptions& o) {
    return o.movie || std::ranges::any_of(o.outputs, [&](const auto& path) { return holds_view(path, o.output.tiff); });
}

Paths files_of(const SequenceOptions& o, std::uint32_t frame) {
    Paths paths;
    for (const auto& pattern : o.outputs) paths.push_back(frame_path(pattern, frame));
    return paths;
}

/// Returns the file that stands for a frame in messages.
std::filesystem::path main_file(const SequenceOptions& o, std::uint32_t frame) {
    return o.outputs.empty() ? *o.movie : frame_path(o.outputs[0], frame);
}

/// Returns the folder of a frame's checkpoint.
std::filesystem::path checkpoint_folder(const SequenceOptions& o, std::uint32_t frame) {
    return main_file(o, frame).string() + ".checkpoint";
}

/// Returns the file that stands for the sequence in messages.
std::string main_name(const SequenceOptions& o) {
    return (o.outputs.empty() ? *o.movie : o.outputs[0]).string();
}

/// A callback has stopped the look at the frames that are there.
struct StoppedBefore {
    std::uint32_t frame;
    std::size_t kept;  // number of whole frames before it
};

/// Returns the frames to make, in order. They include frames that the movie cannot show because they have no .png.
/// Throws Error for files that must not be replaced, and StoppedBefore. `frames`: frames of the part.
std::vector<std::uint32_t> frames_to_make(const SequenceOptions& o, const std::vector<std::uint32_t>& frames,
                                          bool temporal, const std::string& sequence, const SequenceEvents& events,
                                          const Log& log) {
    std::vector<std::uint32_t> todo, damaged;
    const bool shown = !o.movie || wants(o, "png");
    std::size_t not_shown = 0;  // number of complete frames without a .png
    std::size_t seen = 0;
    for (const std::uint32_t frame : frames) {
        if (events.go_on && !events.go_on()) throw StoppedBefore{frame, seen - todo.size()};
        ++seen;
        const std::string fingerprint = frame_fingerprint(sequence, frame);
        bool whole = true;
        for (const auto& path : files_of(o, frame)) {
            const FrameFile file = examine_frame(path, fingerprint);
            if (file == FrameFile::other && !o.overwrite)
                throw Error(path.string(),
                            "exists, but is not this frame of this scene with these settings{} and this version: "
                            "nothing was rendered; --overwrite replaces it",
                            temporal ? ", these --frames (on which --preview temporal depends)" : "");
            if (file == FrameFile::incomplete) damaged.push_back(frame);
            whole = whole && file == FrameFile::whole;
        }
        if (!whole || !shown) todo.push_back(frame);
        not_shown += whole && !shown && !o.outputs.empty() ? 1 : 0;
    }
    if (temporal && !todo.empty() && todo.size() < frames.size()) {
        log.note("--preview temporal: frames depend on earlier ones, and all are made again");
        return frames;
    }
    if (!damaged.empty()) log.note("damaged and made again: frames {}", frames_text(damaged));
    if (not_shown > 0) log.note("{} frames are there, but not as .png for the movie, and are made again", not_shown);
    return todo;
}

/// Appends a line to a file. The last line may lack its newline if a run was killed. An empty `line` appends only
/// that missing newline and creates the file.
void append_line(const std::filesystem::path& path, const std::string& line) {
    const auto check = [&](bool good) {
        if (!good) throw Error(path.string(), "cannot write: {}", std::generic_category().message(errno));
    };
    const int file = open(path.c_str(), O_RDWR | O_CREAT | O_APPEND | O_CLOEXEC, 0666);
    check(file >= 0);
    const off_t size = lseek(file, 0, SEEK_END);
    char last = '\n';
    if (size > 0 && pread(file, &last, 1, size - 1) != 1) last = '\n';
    const std::string text = fmt::format("{}{}{}", last == '\n' ? "" : "\n", line, line.empty() ? "" : "\n");
    // On a full disk or quota, nothing is written instead of a part. Some file systems cannot reserve space.
    const auto bytes = static_cast<off_t>(text.size());
    if (bytes > 0 && fallocate(file, FALLOC_FL_KEEP_SIZE, size, bytes) != 0 && (errno == ENOSPC || errno == EDQUOT)) {
        const int full = errno;
        close(file);
        errno = full;
        check(false);
    }
    std::string_view rest = text;  // a disk that fills takes a part, and the next call has the error
    ssize_t count = 0;
    while (!rest.empty() && ((count = write(file, rest.data(), rest.size())) >= 0 || errno == EINTR))
        rest.remove_prefix(static_cast<std::size_t>(std::max<ssize_t>(count, 0)));
    const int error = errno;
    const bool closed = close(file) == 0;
    if (!rest.empty()) errno = error;
    check(rest.empty() && closed);
}

/// Returns JSON as one line. Bytes of file names that are not UTF-8 are replaced.
std::string line_of(const nlohmann::ordered_json& json) {
    return json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

/// Appends the error of a missing frame to the statistics. A failure to write them does not stop other frames.
void add_failure(const std::filesystem::path& stats, std::uint32_t frame, const std::string& what, const Log& log) {
    try {
        append_line(stats, line_of({{"frame", frame}, {"error", what}}));
    } catch (const Error& error) {
        log.warn("{}", error.what());
    }
}

/// Returns the settings of frames of a sequence.
RenderSettings of_sequence(RenderSettings settings, const LoadedScene& scene) {
    if (!settings.bounces) settings.bounces = default_bounces(scene.scene());
    if (!settings.denoise_frames)
        settings.denoise_frames = settings.denoise && !has_window(settings) ? kDenoiseFrames : 0;
    return settings;
}

std::string fingerprint_of(const LoadedScene& scene, const RenderSettings& settings, const Shutter& shutter,
                           const ColorConfig& colors, const SequenceOptions& o) {
    return sequence_fingerprint(scene, settings, shutter, colors, o.output, part_of(o.frames, o.part));
}

/// Returns the picture that the movie would have shown. The .png is complete and made with these settings.
Image kept_view(const SequenceOptions& o, std::uint32_t frame) {
    const auto png = std::ranges::find_if(o.outputs, [](const auto& path) { return has_extension(path, "png"); });
    const std::filesystem::path path = frame_path(*png, frame);
    return read_png(path.string(), read_file(path, std::uint64_t{1} << 40), kMaxSide);
}

/// Renders and writes frames one after the other. Owns the renderer.
class FrameMaker {
  public:
    FrameMaker(LoadedScene& scene, const RenderSettings& settings, const RendererOptions& renderer,
               const SequenceOptions& options, const SequenceEvents& events, const Log& log, std::string fingerprint)
        : options_(options),
          events_(events),
          log_(log),
          fingerprint_(std::move(fingerprint)),
          requested_view_(settings.view),
          scene_(scene),
          warnings_(scene),
          renderer_(scene, settings, renderer) {
        log_.note("{} x {} pixels, camera {}, on {}", settings.width, settings.height, scene.chosen_camera().origin,
                  renderer_.context().renderer());
    }

    /// Makes a frame and adds it to `movie` if that is not null. Throws Stopped, and Error if the frame cannot be made.
    void make(std::uint32_t frame, Movie* movie) {
        Stopwatch clock;
        StepTimes times;
        const Interruptible stops([&] {
            if (events_.go_on && !events_.go_on()) throw Stopped();
        });
        const StepWatch programs([](const char*, int) { interruption_point(); });
        const auto go_on = [](double) {
            interruption_point();
            return true;
        };
        renderer_.find_estimator(go_on);
        renderer_.find_exposure(go_on);
        if (!exposure_noted_) note_exposure(requested_view_, renderer_.settings(), scene_, log_);
        exposure_noted_ = true;
        const RenderResult result = renderer_.render(frame, [&](const RenderProgress& progress) {
            return !events_.progress || events_.progress(frame, progress);
        });
        times.load = renderer_.load_seconds();
        times.render = clock.lap() - times.load;
        if (result.stats.interrupted) throw Stopped();
        warnings_.tell(renderer_.scene(), log_);
        if (result.stats.biases != logged_biases_) {
            for (const std::string& bias : result.stats.biases) log_.note("biased: {}", bias);
            logged_biases_ = result.stats.biases;
        }
        if (const std::string& problem = renderer_.checkpoint_problem(); !problem.empty())
            log_.warn("frame {}: samples are not saved: {}", frame, problem);
        const Paths outputs = files_of(options_, frame);
        const std::string error = judge(result.stats, options_.output, main_file(options_, frame), log_);
        if (movie) movie->add(result.view);

        const auto write = [&] {
            PictureInfo info = picture_info(renderer_, result, options_.output, error);
            info.frame_rate = renderer_.scene().frame_rate();
            info.frame = frame;
            info.fingerprint = frame_fingerprint(fingerprint_, frame);
            write_pictures(outputs, result, info, log_);
            times.write = clock.lap();
            times.total = clock.seconds();
            if (!options_.stats) return;
            nlohmann::ordered_json line{{"frame", frame}, {"time", scene_.time_of(frame)}};
            line.update(run_statistics(renderer_, result.stats, times, outputs));
            append_line(*options_.stats, line_of(line));
        };
        events_.writing ? events_.writing(write) : write();
        renderer_.remove_checkpoint(frame);
    }

  private:
    const SequenceOptions& options_;
    const SequenceEvents& events_;
    const Log& log_;
    std::string fingerprint_;
    ViewTransform requested_view_;
    const LoadedScene& scene_;
    PoseWarnings warnings_;
    bool exposure_noted_ = false;
    FrameRenderer renderer_;
    std::vector<std::string> logged_biases_;  // biases of the previous frame
};

bool is_whole(const SequenceOptions& o, std::uint32_t frame, const std::string& sequence) {
    return std::ranges::all_of(files_of(o, frame), [&](const std::filesystem::path& path) {
        return examine_frame(path, frame_fingerprint(sequence, frame)) == FrameFile::whole;
    });
}

/// Makes the frames of `todo`. A movie gets all frames in their order, existing ones included. Processes with the same
/// frames share them, unless frames depend on earlier ones of this process. Throws Stopped.
class FrameQueue {
  public:
    FrameQueue(const SequenceOptions& o, const SequenceEvents& events, const Log& log, std::string sequence,
               bool temporal)
        : options_(o), events_(events), log_(log), sequence_(std::move(sequence)) {
        if (!o.outputs.empty() && !temporal) claims_.emplace(o.outputs[0]);
    }

    void make(const std::vector<std::uint32_t>& frames, const std::vector<std::uint32_t>& todo, FrameMaker* maker,
              Movie* movie, SequenceTally& tally) {
        std::set<std::uint32_t> missing(todo.begin(), todo.end());
        const std::vector<std::uint32_t>& wanted = movie ? frames : todo;
        std::deque<std::uint32_t> queue(wanted.begin(), wanted.end());
        std::size_t passed = 0;  // number of frames in a row that other processes make
        std::size_t found = 0;   // number of frames that other processes have made
        while (!queue.empty()) {
            const std::uint32_t frame = queue.front();
            tally.stopped_in = frame;
            if (passed >= (movie ? 1 : queue.size())) wait();
            try {
                if (events_.go_on && !events_.go_on()) throw Stopped();
                if (missing.contains(frame) && claims_) {
                    if (!claims_->take(frame)) {
                        if (!std::exchange(noted_, true)) log_.note("frame {}: another process makes it", frame);
                        ++passed;
                        if (!movie) queue.push_back(frame), queue.pop_front();
                        continue;
                    }
                }
                // Another process may have made the frame since frames_to_make() looked. A movie cannot show an .exr.
                if (missing.contains(frame)) {
                    check_replaceable(frame);
                    const bool shown = !movie || wants(options_, "png");
                    if (claims_ && shown && is_whole(options_, frame, sequence_)) {
                        missing.erase(frame), ++tally.kept;
                        if (events_.found) events_.found(frame, ++found);
                    }
                }
                passed = 0;
                queue.pop_front();
                if (missing.contains(frame))
                    maker->make(frame, movie);
                else if (movie)
                    movie->add(kept_view(options_, frame));
            } catch (const std::exception& error) {  // includes bad_alloc: other frames may need less memory
                if (!queue.empty() && queue.front() == frame) queue.pop_front();
                add_failure_of(frame, error, tally);
                if (options_.outputs.empty()) break;                       // the movie would have a gap
                if (dynamic_cast<const gpu::ContextLost*>(&error)) break;  // other frames would fail, too
                continue;
            }
            if (movie && movie->failed() && options_.outputs.empty()) break;
            if (!missing.contains(frame)) continue;
            ++tally.made;
            if (events_.made) events_.made(frame, tally.made, tally.failed.size());
        }
        tally.stopped_in.reset();
        if (!tally.failed.empty())
            throw Error(main_name(options_), "{} failed{}: {}",
                        frames_of_all(tally.failed, options_.frames.size(), options_.part),
                        options_.movie && !options_.outputs.empty() ? ", and there is no movie" : "", tally.reason);
    }

  private:
    /// Throws Error if another process has written other files of a frame since frames_to_make() looked.
    void check_replaceable(std::uint32_t frame) const {
        if (options_.overwrite) return;
        for (const auto& path : files_of(options_, frame))
            if (examine_frame(path, frame_fingerprint(sequence_, frame)) == FrameFile::other)
                throw Error(path.string(),
                            "was written meanwhile, and is not this frame of this scene with these settings and this "
                            "version; --overwrite replaces it");
    }
    /// Waits a moment for other processes.
    static void wait() { std::this_thread::sleep_for(std::chrono::milliseconds(100)); }

    void add_failure_of(std::uint32_t frame, const std::exception& error, SequenceTally& tally) const {
        const std::string what =
            dynamic_cast<const std::bad_alloc*>(&error) ? "there is not enough memory" : error.what();
        if (events_.failed) events_.failed(frame, what);
        log_.warn("frame {}: {}", frame, what);
        if (tally.failed.empty()) tally.reason = what;
        tally.failed.push_back(frame);
        if (options_.stats) add_failure(*options_.stats, frame, what, log_);
    }

    const SequenceOptions& options_;
    const SequenceEvents& events_;
    const Log& log_;
    const std::string sequence_;  // fingerprint of the sequence
    std::optional<FileClaims> claims_;
    bool noted_ = false;
};

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
    for (const std::uint32_t frame : part_of(o.frames, o.part))
        for (const auto& path : files_of(o, frame)) check(path);
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
        if (!is_picture_name(pattern)) throw Error(pattern.string(), "frames are {} files", picture_extensions());
        if (!patterns.insert(pattern).second) throw Error(pattern.string(), "is given twice");
    }
    Paths files;
    for (const std::uint32_t frame : part_of(o.frames, o.part))
        for (auto& path : files_of(o, frame)) files.push_back(std::move(path));
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

std::vector<std::uint32_t> incomplete_frames(const LoadedScene& scene, const RenderSettings& settings,
                                             const Shutter& shutter, const ColorConfig& colors,
                                             const SequenceOptions& o, const std::function<void()>& look) {
    const std::string fingerprint = fingerprint_of(scene, of_sequence(settings, scene), shutter, colors, o);
    std::vector<std::uint32_t> bad;
    for (const std::uint32_t frame : part_of(o.frames, o.part)) {
        look();
        if (!is_whole(o, frame, fingerprint)) bad.push_back(frame);
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
    if (o.checkpoint)
        options.frame_checkpoints = {[&o, own = std::set<std::uint32_t>()](std::uint32_t frame) mutable {
                                         if (own.empty())
                                             for (const std::uint32_t f : part_of(o.frames, o.part)) own.insert(f);
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
    const std::vector<std::uint32_t> frames = part_of(o.frames, o.part);
    const std::string fingerprint = fingerprint_of(scene, settings, options.shutter, *options.colors, o);
    std::vector<std::uint32_t> todo;
    try {
        todo = frames_to_make(o, frames, settings.preview.temporal, fingerprint, events, log);
    } catch (const StoppedBefore& stopped) {
        return {.frames = frames.size(), .kept = stopped.kept, .stopped_in = stopped.frame};
    }
    if (const std::optional<double> end = scene.animation_end(); end && !frames.empty())
        if (const std::uint32_t last = *std::ranges::max_element(frames); scene.time_of(last - 1.0) > *end)
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
        for (const std::uint32_t frame : frames) Checkpoint::discard(checkpoint_folder(o, frame));
    };
    if (todo.empty() && !o.movie) {
        discard_checkpoints();
        const FileClaims abandoned(o.outputs[0]);  // a process may have been killed after the last frame
        return tally;
    }
    if (events.started) events.started(todo.size());
    const auto make = [&](Movie* movie) {
        std::optional<FrameMaker> maker;
        if (!todo.empty()) maker.emplace(scene, settings, options, o, events, log, fingerprint);
        FrameQueue queue(o, events, log, fingerprint, settings.preview.temporal);
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
