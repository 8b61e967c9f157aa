// Noisy frames as files: those that --keep-noisy keeps, and those that processes of one sequence exchange, so that each
// frame is rendered once.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <utility>

#include "api/sequence/fingerprint.h"
#include "api/sequence/noisy_file.h"
#include "engine/core/frames.h"
#include "engine/io/file_claims.h"

namespace halflight {

/// Reads and writes the noisy frames of one sequence or picture.
class NoisyFiles {
  public:
    struct Options {
        /// Returns the first file of a frame, beside which its noisy frame lies.
        std::function<std::filesystem::path(FrameNumber frame)> picture;
        std::string sums{};                         // sums_fingerprint()
        EditPrints edits{};                         // edits over frames
        int reach = 0;                              // number of frames before and after that motion has to lead to
        bool keep = false;                          // keeps the files: RenderSettings::keep_noisy
        bool overwrite = false;                     // replaces kept files of other settings
        std::vector<std::string> accept_sources{};  // SequenceOptions::accept_sources
        std::optional<float> exposure{};            // NoisyPicture::metered_exposure
        std::filesystem::path pattern{};            // first output of a sequence; empty: nothing is shared
        const FileClaims* sequence = nullptr;       // claims of the frames; tells whether processes share them
        ExrCompression compression = ExrCompression::zip;  // that of kept files
        /// Returns whether a frame is made for itself, and not as a neighbour alone. Empty: all are. Kept neighbours
        /// have other names (near_path()), so that shots may follow each other in a folder.
        std::function<bool(FrameNumber frame)> listed{};
        /// Returns what the files of a picture that was just rendered say.
        std::function<PictureInfo(const RenderResult& result)> info;
    };
    explicit NoisyFiles(Options options);

    /// Returns the noisy frame of a file; none if there is none with the expected fingerprint and reach. Throws Error
    /// for a kept file of other settings, unless it may be replaced.
    std::optional<NoisyPicture> read(FrameNumber frame) const;
    /// Claims the rendering of a frame. Returns false while another process renders it.
    bool claim(FrameNumber frame);
    /// Gives up the claim.
    void release();
    /// Fills in what the file of a frame says. The renderer still has the settings of the frame.
    void describe(FrameNumber frame, NoisyPicture& picture) const;
    /// Writes a frame if it is kept, or if processes share the sequence. A failure to write a file that is not kept
    /// does not matter. Precondition: describe().
    void write(FrameNumber frame, const NoisyPicture& picture) const;
    /// Returns whether write() would write a frame.
    bool writes() const { return options_.keep || (options_.sequence && options_.sequence->others()); }
    void set_sums(std::string sums, EditPrints edits) {
        options_.sums = std::move(sums);
        options_.edits = std::move(edits);
    }
    void set_exposure(float stops) { options_.exposure = stops; }
    bool listed(FrameNumber frame) const { return !options_.listed || options_.listed(frame); }

    /// Returns the file of a frame that the processes of a sequence exchange.
    static std::filesystem::path exchanged_file(const std::filesystem::path& pattern, FrameNumber frame);

  private:
    std::string sums_of(FrameNumber frame) const {
        return with_edits(options_.sums, options_.edits.text(frame, options_.reach));
    }
    std::filesystem::path kept_file(FrameNumber frame) const;
    /// Throws Error for a kept file of other settings, unless it may be replaced.
    void check_replaceable(const std::filesystem::path& kept, FrameNumber frame) const;

    Options options_;
    std::optional<FileClaims> claims_;
};

}  // namespace halflight
