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
#include "api/sequence/develop.h"
#include "api/sequence/fingerprint.h"
#include "api/sequence/frame_files.h"
#include "api/sequence/noisy_files.h"
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

/// Returns the file that stands for the sequence in messages.
std::string main_name(const SequenceOptions& o) {
    return (o.outputs.empty() ? *o.movie : o.outputs[0]).string();
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
                        "exists, but is not this frame of this scene with these settings{} and this version: nothing "
                        "was rendered; --overwrite replaces it",
                        temporal ? ", these --frames (on which --preview temporal depends)" : "");
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

/// Appends a line to a file. The last line may lack its newline if a run was killed. An empty `line` appends only
/// that missing newline and creates the file.
void append_line(const std::filesystem::path& path, const std::string& line) {
    const auto check = [&](bool good) {
        if (!good) throw_write_error(path.string(), errno);
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
void add_failure(const std::filesystem::path& stats, FrameNumber frame, const std::string& what, const Log& log) {
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
        settings.denoise_frames = has_halves(settings) && !has_window(settings) ? kDenoiseFrames : 0;
    return settings;
}

/// Returns the picture that the movie would have shown. The .png is complete and made with these settings.
Image kept_view(const SequenceOptions& o, FrameNumber frame) {
    const auto png = std::ranges::find_if(o.outputs, [](const auto& path) { return has_extension(path, "png"); });
    const std::filesystem::path path = frame_path(*png, frame);
    return read_png(path.string(), read_file(path, std::uint64_t{1} << 40), kMaxSide);
}

/// Renders and writes frames one after the other. Owns the renderer.
class FrameMaker {
  public:
    /// claims: claims of the frames, which processes share; null: nothing is shared.
    FrameMaker(LoadedScene& scene, const RenderSettings& settings, const RendererOptions& renderer,
               const SequenceOptions& options, const SequenceEvents& events, const Log& log, const FrameFiles& files,
               const FileClaims* claims)
        : options_(options),
          events_(events),
          log_(log),
          files_(files),
          requested_view_(settings.view),
          scene_(scene),
          warnings_(scene),
          noisy_files_(noisy_files(claims)),
          renderer_(scene, settings, with_files(renderer)) {
        log_.note("{} x {} pixels, camera {}, on {}", settings.width, settings.height, scene.chosen_camera().origin,
                  renderer_.context().renderer());
    }
    ~FrameMaker() { renderer_.context().make_current(); }  // the developer needs it
    FrameMaker(const FrameMaker&) = delete;
    FrameMaker& operator=(const FrameMaker&) = delete;

    /// Makes a frame and adds it to `movie` if that is not null. Throws Stopped, and Error if the frame cannot be made.
    void make(FrameNumber frame, Movie* movie) {
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
        const std::optional<std::filesystem::path> exr = files_.developable(frame);
        if (!exr) renderer_.find_estimator(go_on);
        renderer_.find_exposure(go_on);
        if (!exposure_noted_) {
            note_exposure(requested_view_, renderer_.settings(), scene_, log_);
            if (noisy_files_ && requested_view_.metered() && !renderer_.settings().view.metered())
                noisy_files_->set_exposure(renderer_.settings().view.exposure.stops);
        }
        exposure_noted_ = true;
        if (exr) return develop(frame, *exr, movie);
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
        const Paths outputs = pictures_of(options_, frame);
        const std::string error = judge(result.stats, options_.output, main_file(options_, frame), log_);
        if (movie) movie->add(result.view);

        const auto write = [&] {
            PictureInfo info = this->info(result, error);
            files_.add_fingerprints(frame, info);
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
    /// Makes the pictures of a frame that are missing from its .exr.
    void develop(FrameNumber frame, const std::filesystem::path& exr, Movie* movie) {
        renderer_.context().make_current();
        if (!developer_)
            developer_.emplace(renderer_.context(), renderer_.colors(), renderer_.settings(), options_.output);
        const RenderResult result = developer_->develop(exr);
        if (movie) movie->add(result.view);
        const auto write = [&] {
            PictureInfo info = this->info(result, "");
            info.frame = frame;
            files_.add_fingerprints(frame, info);
            write_pictures(files_.missing_pictures(frame), result, info, log_);
            if (options_.stats)
                append_line(*options_.stats, line_of({{"frame", frame},
                                                      {"time", scene_.time_of(static_cast<double>(frame))},
                                                      {"developed", exr.string()}}));
        };
        events_.writing ? events_.writing(write) : write();
    }
    /// Returns the files of noisy frames; null if none are needed.
    std::shared_ptr<NoisyFiles> noisy_files(const FileClaims* claims) {
        const bool shared = claims && files_.denoises_near();
        if (!files_.keeps_noisy() && !shared) return nullptr;
        return std::make_shared<NoisyFiles>(
            NoisyFiles::Options{.picture = [this](FrameNumber n) { return main_file(options_, n); },
                                .sums = files_.sums(),
                                .reach = files_.reach(),
                                .keep = files_.keeps_noisy(),
                                .overwrite = options_.overwrite,
                                .pattern = claims ? options_.outputs[0] : "",
                                .sequence = claims,
                                .compression = lossless(options_.output.exr.compression),
                                .listed = [this](FrameNumber n) { return files_.listed(n); },
                                .info = [this](const RenderResult& result) { return info(result, ""); }});
    }
    RendererOptions with_files(RendererOptions renderer) const {
        renderer.noisy_files = noisy_files_;
        return renderer;
    }
    PictureInfo info(const RenderResult& result, const std::string& error) const {
        PictureInfo info = picture_info(renderer_, result, options_.output, error);
        info.frame_rate = scene_.frame_rate();
        info.frame = renderer_.settings().frame;
        return info;
    }

    const SequenceOptions& options_;
    const SequenceEvents& events_;
    const Log& log_;
    const FrameFiles& files_;
    ViewTransform requested_view_;
    const LoadedScene& scene_;
    PoseWarnings warnings_;
    bool exposure_noted_ = false;
    const std::shared_ptr<NoisyFiles> noisy_files_;
    FrameRenderer renderer_;
    std::optional<Developer> developer_;
    std::vector<std::string> logged_biases_;  // biases of the previous frame
};

/// Makes the frames of `todo`. A movie gets all frames in their order, existing ones included. Processes with the same
/// frames share them, unless frames depend on earlier ones of this process. Throws Stopped.
class FrameQueue {
  public:
    /// claims: claims of the frames; null: all are made by this process.
    FrameQueue(const SequenceOptions& o, const SequenceEvents& events, const Log& log, const FrameFiles& files,
               FileClaims* claims)
        : options_(o), events_(events), log_(log), files_(files), claims_(claims) {}

    void make(const std::vector<FrameNumber>& frames, const std::vector<FrameNumber>& todo, FrameMaker* maker,
              Movie* movie, SequenceTally& tally) {
        std::set<FrameNumber> missing(todo.begin(), todo.end());
        const std::vector<FrameNumber>& wanted = movie ? frames : todo;
        std::deque<FrameNumber> queue(wanted.begin(), wanted.end());
        open_ = missing;
        std::size_t passed = 0;  // number of claims in a row that other processes had
        std::size_t found = 0;   // number of frames that other processes have made
        while (!queue.empty()) {
            const FrameNumber frame = queue.front();
            tally.stopped_in = frame;
            if (passed >= (movie ? 1 : queue.size() + queue.size() / kRun)) wait();
            try {
                if (events_.go_on && !events_.go_on()) throw Stopped();
                if (missing.contains(frame) && claims_) {
                    if (!claims_->take(frame)) {
                        if (!std::exchange(noted_, true)) log_.note("frame {}: another process makes it", frame);
                        // Processes take runs of frames, because frames that are denoised share their neighbours.
                        const bool skips = files_.denoises_near() && passed < queue.size() / kRun;
                        ++passed;
                        for (std::size_t i = 0; i < (movie ? 0 : skips ? kRun : 1); ++i)
                            queue.push_back(queue.front()), queue.pop_front();
                        continue;
                    }
                }
                // Another process may have made the frame since frames_to_make() looked. A movie cannot show an .exr.
                if (missing.contains(frame)) {
                    check_replaceable(frame);
                    const bool shown = !movie || wants(options_, "png");
                    if (claims_ && shown && files_.is_whole(frame)) {
                        missing.erase(frame), open_.erase(frame), ++tally.kept;
                        if (events_.found) events_.found(frame, ++found);
                    }
                }
                passed = 0;
                queue.pop_front();
                if (missing.contains(frame))
                    maker->make(frame, movie);
                else if (movie)
                    movie->add(kept_view(options_, frame));
            } catch (const DiskError& error) {  // other frames would fail, too, after hours of rendering
                tally.failed.push_back(frame);
                if (events_.failed) events_.failed(frame, error.what());
                throw DiskError("", "{}: stopped in frame {}, {} of {} frames are there", error.what(), frame,
                                tally.kept + tally.made, tally.frames);
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
            open_.erase(frame);
            if (claims_) files_.discard_exchanged({frame}, open_);
            if (events_.made) events_.made(frame, tally.made, tally.failed.size());
        }
        tally.stopped_in.reset();
        if (claims_) files_.discard_exchanged(frames, open_);
        if (!tally.failed.empty())
            throw Error(main_name(options_), "{} failed{}: {}",
                        frames_of_all(tally.failed, options_.frames.size(), options_.part),
                        options_.movie && !options_.outputs.empty() ? ", and there is no movie" : "", tally.reason);
    }

  private:
    /// Throws Error if another process has written other files of a frame since frames_to_make() looked.
    void check_replaceable(FrameNumber frame) const {
        if (options_.overwrite) return;
        if (const FrameFiles::State state = files_.examine(frame); state.other)
            throw Error(state.other->string(),
                        "was written meanwhile, and is not this frame of this scene with these settings and this "
                        "version; --overwrite replaces it");
    }
    /// Waits a moment for other processes.
    static void wait() { std::this_thread::sleep_for(std::chrono::milliseconds(100)); }

    void add_failure_of(FrameNumber frame, const std::exception& error, SequenceTally& tally) const {
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
    static constexpr std::size_t kRun = 8;  // frames of which another process is taken to make the next ones, too
    const FrameFiles& files_;
    FileClaims* const claims_;
    std::set<FrameNumber> open_;  // frames that are not made yet
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
    const std::vector<FrameNumber> frames = part_of(o.frames, o.part);
    const FrameFiles files(scene, settings, options.shutter, *options.colors, o);
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
