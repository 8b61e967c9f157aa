// The files of the frames of a sequence: their names, and whether they are whole.
#pragma once

#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "api/halflight/sequence.h"
#include "api/sequence/fingerprint.h"

namespace halflight {

/// Returns whether files of that extension are written for each frame.
bool wants(const SequenceOptions& options, std::string_view extension);
/// Returns the file that stands for the sequence in messages.
std::string main_name(const SequenceOptions& options);
/// Returns the pictures of a frame.
std::vector<std::filesystem::path> pictures_of(const SequenceOptions& options, FrameNumber frame);
/// Returns the file that stands for a frame in messages, and beside which files of the frame lie.
std::filesystem::path main_file(const SequenceOptions& options, FrameNumber frame);
/// Returns the folder of a frame's checkpoint.
std::filesystem::path checkpoint_folder(const SequenceOptions& options, FrameNumber frame);

/// Tells which files of a sequence are whole. The options must outlive the object.
class FrameFiles {
  public:
    /// settings: those of the sequence, with the frames before and after that the denoiser uses.
    FrameFiles(const LoadedScene& scene, const RenderSettings& settings, const Shutter& shutter,
               const ColorConfig& colors, const SequenceOptions& options);

    struct State {
        bool whole = true;                             // all files are there
        bool damaged = false;                          // a file cannot be read to its end
        std::optional<std::filesystem::path> other{};  // file without the expected fingerprint
        std::string why{};                             // what differs in it
    };
    /// Examines the files of a frame: pictures, and kept noisy frames, also those of neighbours that have no turn of
    /// their own.
    State examine(FrameNumber frame) const;
    /// Returns the .exr of a frame from which its other pictures can be developed: it is whole, and so are kept noisy
    /// frames. None if there is no such file.
    std::optional<std::filesystem::path> developable(FrameNumber frame) const;
    /// Returns the pictures of a frame that are not whole.
    std::vector<std::filesystem::path> missing_pictures(FrameNumber frame) const;
    bool is_whole(FrameNumber frame) const { return examine(frame).whole; }

    /// Returns the names of all files of noisy frames that the part may write.
    std::vector<std::filesystem::path> noisy_names() const;

    const std::string& sums() const { return sums_; }
    const EditPrints& edits() const { return edits_; }
    int reach() const { return reach_; }
    bool keeps_noisy() const { return keeps_noisy_; }
    /// Returns whether frames are denoised with others.
    bool denoises_near() const { return denoises_ && reach_ > 0; }
    /// Returns whether a frame is one of the sequence, in whichever part.
    bool listed(FrameNumber frame) const { return listed_.contains(frame); }
    /// Sets the fingerprints of a frame's files.
    void add_fingerprints(FrameNumber frame, PictureInfo& info) const;
    /// Removes noisy frames that processes have exchanged, of the frames in `done` and around them, if no frame needs
    /// them any more. open: frames of this part that are not made yet.
    void discard_exchanged(const std::vector<FrameNumber>& done, const std::set<FrameNumber>& open) const;

  private:
    const std::string& print_of(const std::filesystem::path& picture, const PictureInfo& prints) const;
    void examine_noisy(FrameNumber frame, State& state) const;
    void add(const std::filesystem::path& path, const std::string& fingerprint, State& state) const;

    const SequenceOptions& options_;
    bool rounds_;    // an .exr does not hold the bits of its picture
    bool temporal_;  // later frames take light from the rendering of earlier ones
    std::string sums_;
    EditPrints edits_;
    SequencePrints prints_;
    int reach_;
    bool keeps_noisy_, denoises_;
    std::set<FrameNumber> listed_, part_;
};

}  // namespace halflight
