#include "api/halflight/denoise.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include "api/halflight/frame_names.h"
#include "api/halflight/statistics.h"
#include "api/sequence/fingerprint.h"
#include "api/sequence/noisy_file.h"
#include "api/sequence/source_hash.h"
#include "engine/core/error.h"
#include "engine/core/key_text.h"
#include "engine/gpu/program_cache.h"
#include "engine/io/files.h"
#include "renderer/denoise_stage.h"

namespace halflight {
namespace {

using Paths = std::vector<std::filesystem::path>;

/// Returns the noisy frame that a name means: the file itself, or the one beside a picture.
std::filesystem::path noisy_of(const std::filesystem::path& name) {
    if (is_noisy_name(name)) return name;
    std::error_code none;
    const std::filesystem::path beside = noisy_path(name);
    return is_picture_name(name) && std::filesystem::exists(beside, none) ? beside : name;
}

/// A noisy frame that is known by its header.
struct Known {
    std::filesystem::path path;
    NoisyHeader header;
};

/// The noisy frames that are given, and those near them, of which as few as possible are in memory.
class Frames {
  public:
    explicit Frames(const DenoiseOptions& o) : near_(o.near), accepted_(o.accept_sources) {
        for (const auto& name : o.frames) {
            const std::filesystem::path path = noisy_of(name);
            Known known{path, read_noisy_header(path)};
            const FrameNumber frame = known.header.frame;
            if (const auto other = known_.find(frame); other != known_.end())
                throw Error(path.string(), "is frame {}, and so is {}", frame, other->second.path.string());
            given_.insert(frame);
            known_.emplace(frame, std::move(known));
        }
        for (const FrameNumber frame : given_)
            if (const auto& [path, header] = known_.at(frame); near_ && *near_ > header.reach)
                throw Error(path.string(), "was rendered for {} frames before and after, not {} (--denoise-frames)",
                            header.reach, *near_);
        for (const FrameNumber frame : given_)
            for (const FrameNumber n : neighbours(frame)) find(frame, n);
    }

    const std::set<FrameNumber>& given() const { return given_; }
    const Known& known(FrameNumber frame) const { return known_.at(frame); }
    int reach(FrameNumber frame) const { return near_.value_or(known(frame).header.reach); }
    /// Returns the frames that the denoiser uses for a frame.
    std::vector<FrameNumber> neighbours(FrameNumber frame) const {
        std::vector<FrameNumber> all;
        for (const int offset : known(frame).header.motion)
            if (std::abs(offset) <= reach(frame)) all.push_back(frame + offset);
        return all;
    }
    /// Reads a frame and those that it uses, and forgets others.
    NoisyPicture& read(FrameNumber frame) {
        const std::vector<FrameNumber> near = neighbours(frame);
        std::erase_if(
            held_, [&](const auto& h) { return h.first == frame || std::ranges::find(near, h.first) == near.end(); });
        for (const FrameNumber n : near)
            if (!held_.contains(n)) held_.emplace(n, read_noisy_file(known(n).path));
        return held_.insert_or_assign(frame, read_noisy_file(known(frame).path)).first->second;
    }
    std::vector<NearFrame> near(FrameNumber frame) {
        std::vector<NearFrame> all;
        for (const FrameNumber n : neighbours(frame))
            all.push_back({static_cast<int>(n - frame), held_.at(n).noisy.get()});
        return all;
    }

  private:
    /// Finds the file of a neighbour: among those that are given, or beside the frame. Throws Error if it is missing.
    void find(FrameNumber frame, FrameNumber neighbour) {
        const Known& own = known_.at(frame);
        // Frames of one sequence have edits of their own.
        const auto fits = [&](const NoisyHeader& header) {
            return same_keys(without_edits(header.sums), without_edits(own.header.sums), source_hash(), accepted_) &&
                   edit_of(header.sums, 0) == edit_of(own.header.sums, static_cast<int>(neighbour - frame));
        };
        const auto why_not = [&](const NoisyHeader& header) {
            const std::string is = without_edits(header.sums), expected = without_edits(own.header.sums);
            return is == expected ? "edits over frames differ" : differences(is, expected);
        };
        if (const auto given = known_.find(neighbour); given != known_.end()) {
            if (fits(given->second.header)) return;
            throw Error(given->second.path.string(), "is not of the scene and settings of {}: {}", own.path.string(),
                        why_not(given->second.header));
        }
        const auto at = std::ranges::find(own.header.motion, static_cast<int>(neighbour - frame));
        const std::string& name = own.header.near[static_cast<std::size_t>(at - own.header.motion.begin())];
        std::optional<std::filesystem::path> other;
        std::string why;
        for (const char* kind : {".noisy.exr", ".near.exr"}) {
            std::filesystem::path path = own.path.parent_path() / (name + kind);
            std::error_code none;
            if (!std::filesystem::exists(path, none)) continue;
            NoisyHeader header = read_noisy_header(path);
            if (fits(header) && header.frame == neighbour)
                return void(known_.emplace(neighbour, Known{std::move(path), std::move(header)}));
            if (!other) other = std::move(path), why = why_not(header);
        }
        if (other)
            throw Error(other->string(), "is not frame {} of the scene and settings of {}: {}", neighbour,
                        own.path.string(), why);
        throw Error((own.path.parent_path() / (name + ".noisy.exr")).string(),
                    "is missing, and so is {}.near.exr: frame {} takes light from frame {} (--denoise-frames); a frame "
                    "with another name has to be listed, too",
                    name, frame, neighbour);
    }

    std::optional<int> near_;
    const std::vector<std::string>& accepted_;
    std::map<FrameNumber, Known> known_;
    std::set<FrameNumber> given_;
    std::map<FrameNumber, NoisyPicture> held_;
};

/// Returns the pictures of a frame.
Paths outputs_of(const DenoiseOptions& o, FrameNumber frame, const Known& known) {
    if (o.outputs.empty()) return {known.path.parent_path() / (name_of_noisy(known.path) + ".denoised.exr")};
    Paths paths;
    for (const auto& pattern : o.outputs)
        paths.push_back(count_placeholders(pattern) == 0 ? pattern : frame_path(pattern, frame));
    return paths;
}

void check_outputs(const DenoiseOptions& o, std::size_t frames) {
    if (o.frames.empty()) throw Error("denoise", "has no frames");
    for (const auto& pattern : o.outputs) {
        check_not_noisy(pattern);
        if (std::ranges::count(o.outputs, pattern) > 1) throw Error(pattern.string(), "is given twice");
        if (!is_picture_name(pattern)) throw Error(pattern.string(), "an output is an {}", picture_extensions());
        const int placeholders = count_placeholders(pattern);
        if (placeholders > 1) throw Error(pattern.string(), "has {} placeholders for the frame number", placeholders);
        if (placeholders == 0 && frames > 1)
            throw Error(pattern.string(), "has no placeholder for the frame number, such as ####, for {} frames",
                        frames);
        make_folder_of(pattern);
    }
}

/// Denoises frames of equal size, one after the other.
class Denoiser {
  public:
    Denoiser(const DenoiseOptions& o, const Log& log)
        : options_(o),
          log_(log),
          colors_(o.colors ? *o.colors : ColorConfig::load()),
          context_(o.context ? o.context : std::make_shared<gpu::Context>(gpu::Context::create(o.device))),
          current_(*context_),
          programs_(context_->binaries()) {
        want_view_ = std::ranges::any_of(o.outputs, [&](const auto& path) { return holds_view(path, o.output.tiff); });
        if (!want_view_) return;
        const std::optional<DisplayEncoding> encoding = colors_.view(o.view).encoding();
        for (const auto& path : o.outputs) check_encoding(path, o.output.tiff, encoding);
    }
    ~Denoiser() { context_->make_current(); }
    Denoiser(const Denoiser&) = delete;
    Denoiser& operator=(const Denoiser&) = delete;

    /// Adds the fingerprints of a frame.
    void add_fingerprints(const Frames& frames, FrameNumber frame, PictureInfo& info) const {
        const NoisyHeader& header = frames.known(frame).header;
        if (!header.of_sequence) return;  // single pictures have none
        RenderSettings settings;
        settings.denoise = true;
        settings.denoise_frames = frames.reach(frame);
        settings.view = options_.view;
        settings.want_view = want_view_;
        const SequencePrints prints =
            sequence_prints(without_edits(header.sums), settings, colors_, options_.output, {});
        const std::string edits = edits_of(header.sums, frames.reach(frame));
        info.fingerprint = frame_fingerprint(prints.linear, frame, edits);
        if (!prints.view.empty()) info.view_fingerprint = frame_fingerprint(prints.view, frame, edits);
    }

    void make(Frames& frames, FrameNumber frame, const Paths& outputs) {
        context_->make_current();
        NoisyPicture& picture = frames.read(frame);
        const std::string& path = frames.known(frame).path.string();
        RenderResult& result = picture.result;
        PictureInfo info = picture.info;
        for (const auto& output : outputs) check_alpha(output, info.transparent);
        ViewTransform view = options_.view;
        if (want_view_ && view.metered()) {
            if (!picture.metered_exposure)
                throw Error(path, "was made with an exposure of its own, and has none for a picture: see --exposure");
            view.exposure = *picture.metered_exposure;
        }
        const gpu::TextureDesc& desc = picture.noisy->pixels->desc();
        DenoiseStage stage(programs_, {desc.width, desc.height},
                           want_view_ ? std::optional(colors_.view(view)) : std::nullopt, info.transparent);
        const std::vector<NearFrame> near = frames.near(frame);
        for (const NearFrame& other : near)
            if (other.frame->pixels->desc() != desc)
                throw Error(path, "is {} x {} pixels, and frame {} is not", desc.width, desc.height,
                            frame + other.offset);
        stage.denoise(*picture.noisy, near, result);
        context_->check("denoising");
        info.error = judge(result.stats, options_.output, outputs.front(), log_);
        info.working_space = working_space(colors_, options_.output.working_space);
        info.exr = options_.output.exr;
        info.aov_names = options_.output.aov_names;
        info.jpeg_quality = options_.output.jpeg_quality;
        if (want_view_) set_display(info, colors_.view(view), options_.output);
        info.tiff = options_.output.tiff;
        info.reproducible = options_.output.reproducible;
        info.samples = result.stats.samples;
        info.comments += denoised_text(frames.reach(frame));
        info.bias = fmt::format("{}", fmt::join(result.stats.biases, "; "));
        add_fingerprints(frames, frame, info);
        write_pictures(outputs, result, info, log_);
    }

  private:
    struct Current {
        explicit Current(gpu::Context& context) { context.make_current(); }
    };
    const DenoiseOptions& options_;
    const Log& log_;
    const ColorConfig colors_;
    const std::shared_ptr<gpu::Context> context_;
    Current current_;  // the members after it need the context
    gpu::ProgramCache programs_;
    bool want_view_ = false;
};

}  // namespace

DenoiseTally denoise_frames(const DenoiseOptions& o, const std::function<bool(std::size_t, std::size_t)>& go_on,
                            const Log& log) {
    const gpu::KeepCurrent keep;
    check_outputs(o, o.frames.size());
    Frames frames(o);
    Denoiser denoiser(o, log);
    DenoiseTally tally{.frames = frames.given().size()};
    Paths all;
    for (const FrameNumber frame : frames.given())
        for (auto& path : outputs_of(o, frame, frames.known(frame))) all.push_back(std::move(path));
    remove_abandoned(all);
    for (const FrameNumber frame : frames.given()) {
        if (go_on && !go_on(tally.kept + tally.made, tally.frames)) break;
        const Paths outputs = outputs_of(o, frame, frames.known(frame));
        PictureInfo prints;
        denoiser.add_fingerprints(frames, frame, prints);
        bool whole = !prints.fingerprint.empty();
        for (const auto& path : outputs) {
            const bool view = holds_view(path, o.output.tiff);
            std::string why;
            const FrameFile file =
                examine_frame(path, view ? prints.view_fingerprint : prints.fingerprint, o.accept_sources, &why);
            if (file == FrameFile::other && frames.known(frame).header.of_sequence && !o.overwrite)
                throw Error(path.string(),
                            "exists, but is not this denoised frame with these settings: {}; --overwrite replaces it",
                            why);
            whole = whole && file == FrameFile::whole;
        }
        if (whole) {
            ++tally.kept;
            continue;
        }
        denoiser.make(frames, frame, outputs);
        ++tally.made;
    }
    return tally;
}

}  // namespace halflight
