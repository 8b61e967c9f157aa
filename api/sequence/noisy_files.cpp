#include "api/sequence/noisy_files.h"

#include <fmt/format.h>

#include <system_error>
#include <utility>

#include "api/halflight/statistics.h"
#include "api/sequence/fingerprint.h"
#include "api/sequence/source_hash.h"
#include "engine/core/error.h"
#include "engine/core/key_text.h"
#include "engine/core/memory_ledger.h"
#include "engine/io/files.h"
#include "engine/io/temporary_name.h"

namespace halflight {

NoisyFiles::NoisyFiles(Options options) : options_(std::move(options)) {
    if (!options_.pattern.empty()) claims_.emplace(options_.pattern.string() + ".noisy");
}

std::filesystem::path NoisyFiles::exchanged_file(const std::filesystem::path& pattern, FrameNumber frame) {
    return pattern.parent_path() / fmt::format("{}{}.noisy.exr", temporary_prefix(pattern), frame);
}

std::optional<NoisyPicture> NoisyFiles::read(FrameNumber frame) const {
    const auto read = [&](const std::filesystem::path& path) -> std::optional<NoisyPicture> {
        std::error_code none;
        if (!std::filesystem::is_regular_file(path, none)) return std::nullopt;
        try {
            NoisyPicture picture = read_noisy_file(path);
            const std::string sums = with_edits(without_edits(picture.sums), edits_of(picture.sums, options_.reach));
            if (same_keys(sums, sums_of(frame), source_hash(), options_.accept_sources) &&
                picture.info.frame == frame && picture.reach >= options_.reach)
                return picture;
        } catch (const BudgetError&) {
            throw;
        } catch (const Error&) {  // it is rendered again
        }
        return std::nullopt;
    };
    const std::filesystem::path picture = options_.picture(frame), own = kept_file(frame);
    if (auto kept = read(noisy_path(picture))) return kept;
    if (auto kept = read(near_path(picture))) {
        if (options_.keep && listed(frame)) {  // another shot has kept it as a neighbour
            check_replaceable(own, frame);
            write_atomically(own, [&](const std::filesystem::path& temporary) {
                std::filesystem::copy_file(near_path(picture), temporary,
                                           std::filesystem::copy_options::overwrite_existing);
            });
        }
        return kept;
    }
    if (options_.keep || options_.pattern.empty()) return std::nullopt;
    return read(exchanged_file(options_.pattern, frame));
}

bool NoisyFiles::claim(FrameNumber frame) {
    return !claims_ || claims_->take(frame);
}

void NoisyFiles::release() {
    if (claims_) claims_->release();
}

std::filesystem::path NoisyFiles::kept_file(FrameNumber frame) const {
    const std::filesystem::path picture = options_.picture(frame);
    return listed(frame) ? noisy_path(picture) : near_path(picture);
}

void NoisyFiles::check_replaceable(const std::filesystem::path& kept, FrameNumber frame) const {
    if (options_.overwrite) return;
    const std::string print = noisy_fingerprint(sums_of(frame), frame);
    std::string why;
    if (examine_frame(kept, print, options_.accept_sources, &why) == FrameFile::other)
        throw Error(kept.string(), "exists, but is not this noisy frame: {}. It was not replaced; --overwrite does",
                    why);
}

void NoisyFiles::describe(FrameNumber frame, NoisyPicture& picture) const {
    picture.info = options_.info(picture.result);
    picture.info.frame = frame;
    std::string& comments = picture.info.comments;  // the noisy picture is not denoised
    if (const std::string denoised = denoised_text(options_.reach); comments.ends_with(denoised))
        comments.resize(comments.size() - denoised.size());
    picture.sums = sums_of(frame);
    picture.reach = options_.reach;
    picture.metered_exposure = options_.exposure;
    picture.near.clear();
    for (const int offset : picture.noisy->offsets(false))
        picture.near.push_back(options_.picture(frame + offset).stem().string());
}

void NoisyFiles::write(FrameNumber frame, const NoisyPicture& picture) const {
    if (!writes()) return;
    if (options_.keep) {
        const std::filesystem::path path = kept_file(frame);
        check_replaceable(path, frame);
        return write_noisy_file(path, picture, options_.compression);
    }
    try {
        write_noisy_file(exchanged_file(options_.pattern, frame), picture, ExrCompression::none);
    } catch (const Error&) {  // other processes render the frame themselves
    }
}

}  // namespace halflight
