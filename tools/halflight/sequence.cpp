#include "tools/halflight/sequence.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <optional>
#include <set>

#include "engine/gpu/program_binaries.h"
#include "engine/io/files.h"
#include "engine/io/png.h"
#include "tools/halflight/animated_scene.h"
#include "tools/halflight/commands.h"
#include "tools/halflight/fingerprint.h"
#include "tools/halflight/frame_names.h"
#include "tools/halflight/frame_renderer.h"
#include "tools/halflight/movie.h"
#include "tools/halflight/options.h"
#include "tools/halflight/progress.h"
#include "tools/halflight/render_parts.h"
#include "tools/halflight/signals.h"
#include "tools/halflight/statistics.h"

namespace halflight {
namespace {

using Paths = std::vector<std::filesystem::path>;

Paths files_of(const RenderArguments& a, std::uint32_t frame) {
    Paths paths;
    for (const auto& pattern : a.outputs) paths.push_back(frame_path(pattern, frame));
    return paths;
}

/// Folders that cannot be written; a single file that cannot is the matter of its frame.
void check_folders(const RenderArguments& a) {
    for (const auto& pattern : a.outputs) {
        try {
            check_writable(pattern.parent_path() / fmt::format(".halflight-{}-probe", getpid()));
        } catch (const Error&) {
            check_writable(pattern);  // by the name that the user gave
            throw;
        }
    }
    if (a.stats) check_writable(*a.stats);
}

/// What a frame is called where it has several files, or none.
std::filesystem::path main_file(const RenderArguments& a, std::uint32_t frame) {
    return a.outputs.empty() ? *a.movie : frame_path(a.outputs[0], frame);
}

/// The same of the sequence.
std::string main_name(const RenderArguments& a) {
    return (a.outputs.empty() ? *a.movie : a.outputs[0]).string();
}

/// Of those asked for, in their order. Frames that a movie cannot show from a .png are among them. Throws Error for
/// files that are not to be replaced.
std::vector<std::uint32_t> frames_to_make(const RenderArguments& a, const std::string& sequence,
                                          const Console& console) {
    std::vector<std::uint32_t> todo, damaged;
    const bool shown = !a.movie || wants(a, "png");
    std::size_t not_shown = 0;  // of those that are whole
    for (const std::uint32_t frame : a.frames) {
        const std::string fingerprint = frame_fingerprint(sequence, frame);
        bool whole = true;
        for (const auto& path : files_of(a, frame)) {
            const FrameFile file = examine_frame(path, fingerprint);
            if (file == FrameFile::other && !a.overwrite)
                throw Error(path.string(),
                            "is there and is another frame, of another scene, other settings{} or another version: "
                            "nothing was rendered; --overwrite replaces it",
                            a.settings.preview.temporal ? ", other --frames (which --preview temporal goes on from)" : "");
            if (file == FrameFile::incomplete) damaged.push_back(frame);
            whole = whole && file == FrameFile::whole;
        }
        if (!whole || !shown) todo.push_back(frame);
        not_shown += whole && !shown && !a.outputs.empty() ? 1 : 0;
    }
    if (a.settings.preview.temporal && !todo.empty() && todo.size() < a.frames.size()) {
        console.note("--preview temporal: frames go on from those before them, and all are made again");
        return a.frames;
    }
    if (!damaged.empty()) console.note("damaged and made again: frames {}", frames_text(damaged));
    if (not_shown > 0)
        console.note("{} frames are there, but not as .png for the movie, and are made again", not_shown);
    return todo;
}

/// A line at the end of the file, which a run that was killed may have left without the end of its last one. Of an
/// empty one no more than that end, so that there is a file.
void append_line(const std::filesystem::path& path, const std::string& line) {
    const auto check = [&](bool good) {
        if (!good) throw Error(path.string(), "cannot write: {}", std::generic_category().message(errno));
    };
    const int file = open(path.c_str(), O_RDWR | O_CREAT | O_APPEND | O_CLOEXEC, 0666);
    check(file >= 0);
    const off_t size = lseek(file, 0, SEEK_END);
    char last = '\n';
    if (size > 0 && pread(file, &last, 1, size - 1) != 1) last = '\n';
    const std::string text = (last == '\n' ? "" : "\n") + (line.empty() ? "" : line + "\n");
    const bool written = write(file, text.data(), text.size()) == static_cast<ssize_t>(text.size());
    const bool closed = close(file) == 0;
    check(written && closed);
}

/// Names of files may be no UTF-8, which JSON cannot hold.
std::string line_of(const nlohmann::ordered_json& json) {
    return json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

/// Why a frame is not there. That the file of statistics cannot be written, either, stops no other frame.
void add_failure(const std::filesystem::path& stats, std::uint32_t frame, const std::string& what,
                 const Console& console) {
    try {
        append_line(stats, line_of({{"frame", frame}, {"error", what}}));
    } catch (const Error& error) {
        console.warn("{}", error.what());
    }
}

class Sequence {
  public:
    Sequence(const RenderArguments& a, const Console& console)
        : a_(a), console_(console), config_(ColorConfig::load(a.ocio)) {
        if (wants(a, "png") || a.movie) display_ = config_.view(a.settings.view).display();
        space_ = working_space(config_, a);
        scene_.emplace(a, console);
        settings_ = make_settings(a, scene_->chosen_camera().camera);
        fingerprint_ = sequence_fingerprint(a, settings_, *scene_, config_);
    }

    const std::string& fingerprint() const { return fingerprint_; }
    MovieFormat movie_format() const {
        const bool srgb = display_.find("sRGB") != std::string::npos;
        return {{settings_.width, settings_.height}, scene_->frame_rate(), srgb};
    }

    void start(std::size_t frames) {
        settings_.pictures = static_cast<int>(frames);
        context_.emplace(
            gpu::Context::create({.device = a_.device,
                                  .binaries_folder = a_.no_shader_cache ? "" : gpu::default_binaries_folder(),
                                  .debug = a_.gl_debug}));
        renderer_.emplace(a_, *scene_, *context_, config_, settings_);
        console_.note("{} x {} pixels, camera {}, on {}", settings_.width, settings_.height,
                      scene_->chosen_camera().origin, context_->renderer());
    }

    /// False: interrupted, and nothing was written. Throws Error where the frame cannot be made. `movie`: or null.
    bool make(std::uint32_t frame, SequenceDisplay& display, Movie* movie) {
        Stopwatch watch;
        StepTimes times;
        const RenderResult result = renderer_->render(frame, [&](const RenderProgress& progress) {
            display.show(frame, progress);
            return stop_signal() == 0;
        });
        context_->check("rendering");
        times.load = renderer_->load_seconds();
        times.render = watch.lap() - times.load;
        if (result.stats.interrupted) return false;
        if (result.stats.biases != told_biases_) {
            for (const std::string& bias : result.stats.biases) console_.note("biased: {}", bias);
            told_biases_ = result.stats.biases;
        }
        const Paths outputs = files_of(a_, frame);
        const std::string error = judge(a_, result.stats, main_file(a_, frame), console_);
        if (movie) movie->add(result.view);

        const WritingFiles writing;
        PictureInfo info = picture_info(a_, renderer_->settings(), space_, scene_->scene(), result.stats, error);
        info.frame_rate = scene_->frame_rate();
        info.frame = frame;
        info.fingerprint = frame_fingerprint(fingerprint_, frame);
        for (const auto& path : outputs) write_picture(path, result, info);
        times.write = watch.lap();
        times.total = watch.seconds();
        if (a_.stats) add_statistics(frame, outputs, result.stats, times);
        return true;
    }

  private:
    void add_statistics(std::uint32_t frame, const Paths& outputs, const RenderStats& stats, const StepTimes& times) {
        RenderArguments of_frame = a_;
        of_frame.outputs = outputs;
        nlohmann::ordered_json line{{"frame", frame}, {"time", scene_->frame_rate().seconds(frame)}};
        line.update(run_statistics(of_frame, renderer_->settings(), scene_->scene(), *context_, stats, times,
                                   renderer_->deformed()));
        append_line(*a_.stats, line_of(line));
    }

    const RenderArguments& a_;
    const Console& console_;
    ColorConfig config_;
    std::string display_;  // of the view, where there is one
    LinearSpace space_;
    std::optional<AnimatedScene> scene_;
    RenderSettings settings_;
    std::string fingerprint_;
    std::optional<gpu::Context> context_;
    std::optional<FrameRenderer> renderer_;
    std::vector<std::string> told_biases_;  // of the last frame
};

/// "frames 3,7-9 of 24", "frame 4 of part 2/5", for messages.
std::string of_all(std::vector<std::uint32_t> frames, const RenderArguments& a) {
    std::ranges::sort(frames);
    const std::string whole =
        a.part.of == 1 ? std::to_string(a.frames.size()) : fmt::format("part {}/{}", a.part.number, a.part.of);
    return fmt::format("frame{} {} of {}", frames.size() == 1 ? "" : "s", frames_text(frames), whole);
}

std::string counted(std::size_t frames) {
    return fmt::format("{} frame{}", frames, frames == 1 ? "" : "s");
}

void check_frames(const RenderArguments& a, const Console& console) {
    const std::string fingerprint = Sequence(a, console).fingerprint();
    std::vector<std::uint32_t> bad;
    for (const std::uint32_t frame : a.frames) {
        const auto is_whole = [&](const std::filesystem::path& path) {
            return examine_frame(path, frame_fingerprint(fingerprint, frame)) == FrameFile::whole;
        };
        if (!std::ranges::all_of(files_of(a, frame), is_whole)) bad.push_back(frame);
    }
    if (!bad.empty())
        throw Error(a.outputs[0].string(), "{}: missing, damaged, or of another scene or other settings",
                    of_all(bad, a));
    console.note("{}: all {} frames are whole", a.outputs[0].string(), a.frames.size());
}

/// What became of the frames so far.
struct Tally {
    std::size_t kept = 0;
    std::size_t made = 0;
    std::vector<std::uint32_t> failed;
    std::string reason;  // of the first failure
};

/// As the movie would have got it; the .png is whole, and of these settings.
Image kept_view(const RenderArguments& a, std::uint32_t frame) {
    const auto png = std::ranges::find_if(a.outputs, [](const auto& path) { return has_extension(path, "png"); });
    const std::filesystem::path path = frame_path(*png, frame);
    return read_png(path.string(), read_file(path, std::uint64_t{1} << 40), kMaxSide);
}

/// Makes the frames of `todo`; with a movie, which gets all frames in their order, shows it those that are there.
/// Throws Interrupted after a signal.
void make_frames(const RenderArguments& a, const std::vector<std::uint32_t>& todo, Sequence& sequence, Movie* movie,
                 Tally& tally, const Console& console) {
    const std::set<std::uint32_t> missing(todo.begin(), todo.end());
    const Stopwatch watch;
    SequenceDisplay display(stderr, a.quiet, todo.size());
    for (const std::uint32_t frame : movie ? a.frames : todo) {
        const bool kept = !missing.contains(frame);
        bool done = false;
        try {
            done = stop_signal() == 0;
            if (done && kept)
                movie->add(kept_view(a, frame));
            else if (done)
                done = sequence.make(frame, display, movie);
        } catch (const std::exception& error) {  // bad_alloc, too: other frames may need less
            const std::string what =
                dynamic_cast<const std::bad_alloc*>(&error) ? "there is not enough memory" : error.what();
            display.clear();
            console.warn("frame {}: {}", frame, what);
            if (tally.failed.empty()) tally.reason = what;
            tally.failed.push_back(frame);
            if (a.stats) add_failure(*a.stats, frame, what, console);
            if (a.outputs.empty()) return;  // it would be a movie with a gap
            continue;
        }
        if (!done)
            throw Interrupted(stop_signal(), main_name(a),
                              a.outputs.empty() ? fmt::format("not written: interrupted in frame {}", frame)
                                                : fmt::format("interrupted in frame {}: {} of {} frames are there",
                                                              frame, tally.kept + tally.made, a.frames.size()));
        if (movie && movie->failed() && a.outputs.empty()) return;
        if (kept) continue;
        ++tally.made;
        display.made(frame, tally.made, tally.failed.size(), watch.seconds());
    }
}

/// Throws Error where frames have failed.
void check_all_made(const RenderArguments& a, const Tally& tally) {
    if (!tally.failed.empty())
        throw Error(main_name(a), "{} failed{}: {}", of_all(tally.failed, a),
                    a.movie && !a.outputs.empty() ? ", and there is no movie" : "", tally.reason);
}

}  // namespace

void run_sequence(const RenderArguments& all) {
    RenderArguments a = all;
    a.frames = part_of(all.frames, all.part);
    const Console console(a.quiet);
    if (a.frames.empty()) {
        console.note("there are fewer frames than parts: none in part {} of {}", a.part.number, a.part.of);
        return;
    }
    if (a.check) return check_frames(a, console);
    Paths files = output_files(a);
    if (a.movie) files.push_back(*a.movie);
    remove_abandoned(files);
    check_folders(a);
    Sequence sequence(a, console);
    const std::vector<std::uint32_t> todo = frames_to_make(a, sequence.fingerprint(), console);
    if (a.stats) append_line(*a.stats, "");
    Tally tally;
    tally.kept = a.frames.size() - todo.size();
    if (tally.kept > 0) console.note("{} of {} frames are there already", tally.kept, a.frames.size());
    if (todo.empty() && !a.movie) return;

    const Stopwatch watch;
    const auto make = [&](Movie* movie) {
        if (!todo.empty()) sequence.start(todo.size());
        make_frames(a, todo, sequence, movie, tally, console);
        check_all_made(a, tally);
    };
    if (a.movie) {
        write_atomically(*a.movie, [&](const std::filesystem::path& temporary) {
            Movie movie(temporary, a.movie->string(), sequence.movie_format());
            make(&movie);
            movie.finish();
        });
    } else {
        make(nullptr);
    }
    if (tally.made > 0 && !a.outputs.empty())
        console.note("wrote {}: {} in {:.1f} s", main_name(a), counted(tally.made), watch.seconds());
    if (a.movie) console.note("wrote {}: {}", a.movie->string(), counted(a.frames.size()));
}

}  // namespace halflight
