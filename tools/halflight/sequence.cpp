#include "tools/halflight/sequence.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <optional>

#include "engine/gpu/program_binaries.h"
#include "engine/io/files.h"
#include "tools/halflight/animated_scene.h"
#include "tools/halflight/commands.h"
#include "tools/halflight/fingerprint.h"
#include "tools/halflight/frame_names.h"
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

/// Of those asked for, in their order. Throws Error for files that are not to be replaced.
std::vector<std::uint32_t> frames_to_make(const RenderArguments& a, const std::string& sequence,
                                          const Console& console) {
    std::vector<std::uint32_t> todo, damaged;
    for (const std::uint32_t frame : a.frames) {
        const std::string fingerprint = frame_fingerprint(sequence, frame);
        bool whole = true;
        for (const auto& path : files_of(a, frame)) {
            const FrameFile file = examine_frame(path, fingerprint);
            if (file == FrameFile::other && !a.overwrite)
                throw Error(path.string(),
                            "is there and is another frame, of another scene, other settings or another version: "
                            "nothing was rendered; "
                            "--overwrite replaces it");
            if (file == FrameFile::incomplete) damaged.push_back(frame);
            whole = whole && file == FrameFile::whole;
        }
        if (!whole) todo.push_back(frame);
    }
    if (!damaged.empty()) console.note("damaged and made again: frames {}", frames_text(damaged));
    return todo;
}

/// A line at the end of the file, which a run that was killed may have left without the end of its last one.
void append_line(const std::filesystem::path& path, const std::string& line) {
    const auto check = [&](bool good) {
        if (!good) throw Error(path.string(), "cannot write: {}", std::generic_category().message(errno));
    };
    const int file = open(path.c_str(), O_RDWR | O_CREAT | O_APPEND | O_CLOEXEC, 0666);
    check(file >= 0);
    const off_t size = lseek(file, 0, SEEK_END);
    char last = '\n';
    if (size > 0 && pread(file, &last, 1, size - 1) != 1) last = '\n';
    const std::string text = (last == '\n' ? "" : "\n") + line + "\n";
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
        if (wants(a, "png")) config_.view(a.view);  // for its errors
        space_ = working_space(config_, a);
        scene_.emplace(a, console);
        settings_ = make_settings(a, scene_->chosen_camera().camera);
        fingerprint_ = sequence_fingerprint(a, settings_, *scene_, config_);
    }

    const std::string& fingerprint() const { return fingerprint_; }

    void start(std::size_t frames) {
        settings_.pictures = scene_->surfaces_move() ? 1 : static_cast<int>(frames);
        context_.emplace(
            gpu::Context::create({.device = a_.device,
                                  .binaries_folder = a_.no_shader_cache ? "" : gpu::default_binaries_folder(),
                                  .debug = a_.gl_debug}));
        console_.note("{} x {} pixels, camera {}, on {}", settings_.width, settings_.height,
                      scene_->chosen_camera().origin, context_->renderer());
    }

    /// False: interrupted, and nothing was written. Throws Error where the frame cannot be made.
    bool make(std::uint32_t frame, SequenceDisplay& display) {
        rendered_ = false;
        try {
            return try_to_make(frame, display);
        } catch (...) {
            if (!rendered_) renderer_.reset();  // may be in the middle of anything
            throw;
        }
    }

  private:
    bool try_to_make(std::uint32_t frame, SequenceDisplay& display) {
        Clock clock;
        StepTimes times;
        const double seconds = a_.frame_rate.seconds(frame);
        if (scene_->pose(seconds)) renderer_.reset();
        set_frame(settings_, *scene_, a_.frame_rate, frame);
        times.load = clock.lap();
        if (!renderer_) renderer_.emplace(*context_, scene_->scene(), config_, settings_);
        const RenderResult result = renderer_->render(settings_, [&](const RenderProgress& progress) {
            display.show(frame, progress);
            return stop_signal() == 0;
        });
        context_->check("rendering");
        times.render = clock.lap();
        rendered_ = true;
        if (result.stats.interrupted) return false;
        const Paths outputs = files_of(a_, frame);
        const std::string error = judge(a_, result.stats, outputs[0], console_);

        const WritingFiles writing;
        PictureInfo info = picture_info(a_, settings_, space_, scene_->scene(), result.stats, error);
        info.frame_rate = a_.frame_rate;
        info.frame = frame;
        info.fingerprint = frame_fingerprint(fingerprint_, frame);
        for (const auto& path : outputs) write_picture(path, result, info);
        times.write = clock.lap();
        times.total = clock.seconds();
        if (a_.stats) add_statistics(frame, seconds, outputs, result.stats, times);
        return true;
    }

    void add_statistics(std::uint32_t frame, double seconds, const Paths& outputs, const RenderStats& stats,
                        const StepTimes& times) {
        RenderArguments of_frame = a_;
        of_frame.outputs = outputs;
        nlohmann::ordered_json line{{"frame", frame}, {"time", seconds}};
        line.update(run_statistics(of_frame, settings_, scene_->scene(), *context_, stats, times));
        append_line(*a_.stats, line_of(line));
    }

    const RenderArguments& a_;
    const Console& console_;
    ColorConfig config_;
    LinearSpace space_;
    std::optional<AnimatedScene> scene_;
    RenderSettings settings_;
    std::string fingerprint_;
    std::optional<gpu::Context> context_;
    std::optional<Renderer> renderer_;  // lives on while nothing but cameras moves
    bool rendered_ = false;             // the frame that is being made
};

/// "frames 3,7-9 of 24", for messages.
std::string of_all(const std::vector<std::uint32_t>& frames, const RenderArguments& a) {
    return fmt::format("frame{} {} of {}", frames.size() == 1 ? "" : "s", frames_text(frames), a.frames.size());
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
    check_folders(a);
    Sequence sequence(a, console);
    const std::vector<std::uint32_t> todo = frames_to_make(a, sequence.fingerprint(), console);
    const std::string pattern = a.outputs[0].string();
    const std::size_t kept = a.frames.size() - todo.size();
    if (kept > 0) console.note("{} of {} frames are there already", kept, a.frames.size());
    if (todo.empty()) return;
    sequence.start(todo.size());

    std::vector<std::uint32_t> failed;
    std::string reason;  // of the first failure
    std::size_t made = 0;
    const Clock clock;
    {
        SequenceDisplay display(stderr, a.quiet, todo.size());
        for (const std::uint32_t frame : todo) {
            bool done = false;
            try {
                done = stop_signal() == 0 && sequence.make(frame, display);
            } catch (const std::exception& error) {  // bad_alloc, too: other frames may need less
                const std::string what =
                    dynamic_cast<const std::bad_alloc*>(&error) ? "there is not enough memory" : error.what();
                display.clear();
                console.warn("frame {}: {}", frame, what);
                if (failed.empty()) reason = what;
                failed.push_back(frame);
                if (a.stats) add_failure(*a.stats, frame, what, console);
                continue;
            }
            if (!done)
                throw Interrupted(stop_signal(), pattern,
                                  fmt::format("interrupted in frame {}: {} of {} frames are there", frame, kept + made,
                                              a.frames.size()));
            ++made;
            display.made(frame, made, failed.size(), clock.seconds());
        }
    }
    if (!failed.empty()) throw Error(pattern, "{} failed: {}", of_all(failed, a), reason);
    console.note("wrote {}: {} frames in {:.1f} s", pattern, made, clock.seconds());
}

}  // namespace halflight
