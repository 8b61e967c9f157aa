#include "api/sequence/frame_files.h"

#include <algorithm>
#include <system_error>

#include "api/halflight/frame_names.h"
#include "api/sequence/develop.h"
#include "api/sequence/noisy_files.h"
#include "engine/core/error.h"
#include "engine/core/key_text.h"
#include "engine/core/memory_ledger.h"
#include "engine/io/files.h"

namespace halflight {
namespace {

/// Returns the neighbours of a noisy frame.
std::vector<FrameNumber> neighbours_of(const std::filesystem::path& noisy, FrameNumber frame, int reach) {
    std::vector<FrameNumber> neighbours;
    for (const int offset : read_noisy_header(noisy).motion)
        if (std::abs(offset) <= reach) neighbours.push_back(frame + offset);
    return neighbours;
}

}  // namespace

bool wants(const SequenceOptions& o, std::string_view extension) {
    return std::ranges::any_of(o.outputs, [&](const auto& path) { return has_extension(path, extension); });
}

std::string main_name(const SequenceOptions& o) {
    return (o.outputs.empty() ? *o.movie : o.outputs[0]).string();
}

std::vector<std::filesystem::path> pictures_of(const SequenceOptions& o, FrameNumber frame) {
    std::vector<std::filesystem::path> paths;
    for (const auto& pattern : o.outputs) paths.push_back(frame_path(pattern, frame));
    return paths;
}

std::filesystem::path main_file(const SequenceOptions& o, FrameNumber frame) {
    return o.outputs.empty() ? *o.movie : frame_path(o.outputs[0], frame);
}

std::filesystem::path checkpoint_folder(const SequenceOptions& o, FrameNumber frame) {
    return main_file(o, frame).string() + ".checkpoint";
}

FrameFiles::FrameFiles(const LoadedScene& scene, const RenderSettings& settings, const Shutter& shutter,
                       const ColorConfig& colors, const SequenceOptions& options)
    : options_(options),
      rounds_(!holds_bits(settings, options.output, colors)),
      temporal_(settings.preview.temporal),
      sums_(sums_fingerprint(scene, settings, shutter)),
      edits_(scene, settings, shutter),
      prints_(sequence_prints(sums_, settings, colors, options.output, part_of(options.frames, options.part))),
      reach_(neighbour_frames(settings)),
      keeps_noisy_(settings.keep_noisy),
      denoises_(settings.denoise),
      listed_(options.frames.begin(), options.frames.end()) {
    for (const FrameNumber frame : part_of(options.frames, options.part)) part_.insert(frame);
}

void FrameFiles::add(const std::filesystem::path& path, const std::string& fingerprint, State& state) const {
    std::string why;
    const FrameFile file = examine_frame(path, fingerprint, options_.accept_sources, &why);
    if (file == FrameFile::other && !state.other) state.other = path, state.why = why;
    state.damaged = state.damaged || file == FrameFile::incomplete;
    state.whole = state.whole && file == FrameFile::whole;
}

const std::string& FrameFiles::print_of(const std::filesystem::path& picture, const PictureInfo& prints) const {
    return holds_view(picture, options_.output.tiff) ? prints.view_fingerprint : prints.fingerprint;
}

FrameFiles::State FrameFiles::examine(FrameNumber frame) const {
    PictureInfo prints;
    add_fingerprints(frame, prints);
    State state;
    for (const auto& path : pictures_of(options_, frame)) add(path, print_of(path, prints), state);
    examine_noisy(frame, state);
    return state;
}

void FrameFiles::examine_noisy(FrameNumber frame, State& state) const {
    if (!keeps_noisy_) return;
    const auto print = [&](FrameNumber n) { return noisy_fingerprint(with_edits(sums_, edits_.text(n, reach_)), n); };
    const auto noisy = [&](FrameNumber n) { return noisy_path(main_file(options_, n)); };
    State own;
    add(noisy(frame), print(frame), own);
    const bool known = own.whole;  // the neighbours of others are known once they are rendered
    const std::vector<FrameNumber> needed =
        known ? neighbours_of(noisy(frame), frame, reach_) : std::vector<FrameNumber>();
    for (FrameNumber n = frame - reach_; n <= frame + reach_; ++n) {
        if (n < kLeastFrame || n > kMostFrame || listed(n)) continue;
        const bool needs = std::ranges::find(needed, n) != needed.end();
        if (known && !needs) continue;
        if (examine_frame(noisy(n), print(n), options_.accept_sources) == FrameFile::whole) continue;
        State near;
        add(near_path(main_file(options_, n)), print(n), near);
        if (!own.other) own.other = near.other, own.why = near.why;
        if (needs) own.whole = own.whole && near.whole, own.damaged = own.damaged || near.damaged;
    }
    if (!state.other) state.other = own.other, state.why = own.why;
    state.whole = state.whole && own.whole, state.damaged = state.damaged || own.damaged;
}

std::vector<std::filesystem::path> FrameFiles::noisy_names() const {
    std::set<FrameNumber> near;
    for (const FrameNumber frame : part_)
        for (FrameNumber n = frame - reach_; n <= frame + reach_; ++n)
            if (n >= kLeastFrame && n <= kMostFrame) near.insert(n);
    std::vector<std::filesystem::path> names;
    for (const FrameNumber n : near) {
        const std::filesystem::path picture = main_file(options_, n);
        if (keeps_noisy_) names.push_back(listed(n) ? noisy_path(picture) : near_path(picture));
        if (denoises_near() && !options_.outputs.empty())
            names.push_back(NoisyFiles::exchanged_file(options_.outputs[0], n));
    }
    return names;
}

std::optional<std::filesystem::path> FrameFiles::developable(FrameNumber frame) const {
    if (temporal_ || (rounds_ && !options_.develop)) return std::nullopt;
    PictureInfo prints;
    add_fingerprints(frame, prints);
    std::optional<std::filesystem::path> exr;
    State state;
    // Layers and exact colours of other scene-linear files are not in the .exr, so all of these have to be there.
    for (const auto& pattern : options_.outputs) {
        if (holds_view(pattern, options_.output.tiff)) continue;
        const std::filesystem::path path = frame_path(pattern, frame);
        add(path, prints.fingerprint, state);
        if (!exr && has_extension(path, "exr")) exr = path;
    }
    if (!exr) return std::nullopt;
    if (state.whole) examine_noisy(frame, state);
    return state.whole ? exr : std::nullopt;
}

std::vector<std::filesystem::path> FrameFiles::missing_pictures(FrameNumber frame) const {
    PictureInfo prints;
    add_fingerprints(frame, prints);
    std::vector<std::filesystem::path> paths = pictures_of(options_, frame);
    std::erase_if(paths, [&](const auto& path) {
        return examine_frame(path, print_of(path, prints), options_.accept_sources) == FrameFile::whole;
    });
    return paths;
}

void FrameFiles::add_fingerprints(FrameNumber frame, PictureInfo& info) const {
    const std::string edits = edits_.text(frame, denoises_ ? reach_ : 0);
    info.fingerprint = frame_fingerprint(prints_.linear, frame, edits);
    if (prints_.view.empty()) return;
    // Pictures that are developed from rounded ones differ from those that are rendered.
    const bool rounded = rounds_ && options_.develop;
    info.view_fingerprint =
        frame_fingerprint(rounded ? KeyText(prints_.view).add("colors", "rounded").text() : prints_.view, frame, edits);
}

void FrameFiles::discard_exchanged(const std::vector<FrameNumber>& done, const std::set<FrameNumber>& open) const {
    // With --overwrite, pictures of earlier settings may be there. Those that were made from a file are younger.
    const auto waits = [&](FrameNumber frame, std::filesystem::file_time_type since) {
        if (part_.contains(frame) && !open.contains(frame)) return false;
        return std::ranges::any_of(pictures_of(options_, frame), [&](const auto& path) {
            std::error_code missing;
            const auto time = std::filesystem::last_write_time(path, missing);
            return missing || (options_.overwrite && time < since);
        });
    };
    if (options_.outputs.empty() || reach_ == 0) return;
    std::set<FrameNumber> near;
    for (const FrameNumber frame : done)
        for (FrameNumber n = frame - reach_; n <= frame + reach_; ++n) near.insert(n);
    for (const FrameNumber n : near) {
        const std::filesystem::path file = NoisyFiles::exchanged_file(options_.outputs[0], n);
        std::error_code none;
        const auto time = std::filesystem::last_write_time(file, none);
        if (none) continue;
        bool needed = false;
        for (FrameNumber frame = n - reach_; frame <= n + reach_; ++frame)
            needed = needed || (listed(frame) && waits(frame, time));
        if (!needed) std::filesystem::remove(file, none);
    }
}

}  // namespace halflight
