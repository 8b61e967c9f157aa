// Fingerprints of frames: texts in their files by which later runs recognise frames of the same settings, and tell what
// differs (engine/core/key_text.h). Hashes stand for files, cameras and edits of several numbers. Settings that are as
// usual are left out.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "api/halflight/frame_renderer.h"
#include "api/halflight/loaded_scene.h"
#include "api/halflight/picture_file.h"
#include "engine/color/color.h"
#include "engine/settings/render_settings.h"

namespace halflight {

/// Returns a fingerprint of everything that decides the sums of the samples of frames. It covers the contents of the
/// scene's files and of the environment map, the settings with Setting::fingerprint, and the version of the program. It
/// leaves out the settings of the denoiser and of the group Colour, which apply to the finished picture. Throws Error
/// for a file that can no longer be read, or has changed since it was loaded.
std::string sums_fingerprint(const LoadedScene& scene, const RenderSettings& settings, const Shutter& shutter);

/// Part of the fingerprint of a frame that edits over frames add: a key for the frame itself, and one for each near it
/// that the denoiser uses. Frames whose values did not change keep their fingerprints.
class EditPrints {
  public:
    EditPrints() = default;
    EditPrints(const LoadedScene& scene, const RenderSettings& settings, const Shutter& shutter);
    /// Returns the keys of a frame and of `reach` frames before and after it; empty without edits over frames.
    std::string text(FrameNumber frame, int reach) const;

  private:
    EditKeys keys_;
    SceneEdits base_;
    double before_ = 0, after_ = 0;  // frames by which the shutter opens before, and closes after the frame's time
    bool previous_ = false;          // the frame shows motion since the one before
};
/// Returns a text with further keys.
std::string with_edits(const std::string& sums, const std::string& edits);
/// Returns the keys of EditPrints::text() in a text, up to `reach`.
std::string edits_of(const std::string& sums, int reach);
/// Returns the key of EditPrints::text() for the frame `offset` after the own one; empty if there is none.
std::string edit_of(const std::string& sums, int offset);
/// Returns a text without these keys, as all frames of a sequence have it.
std::string without_edits(const std::string& sums);

/// Fingerprints of a sequence.
struct SequencePrints {
    std::string linear;  // scene-linear files
    std::string view;    // files through the view transform; empty if none is wanted
};

/// Returns the fingerprints of everything that decides the pixels of a sequence. They add to sums_fingerprint() the
/// settings that it leaves out, outputs, and the colour config with its LUTs as far as the files depend on it.
/// `frames`: those of the sequence, on which frames depend with Preview::temporal.
SequencePrints sequence_prints(const std::string& sums, const RenderSettings& settings, const ColorConfig& config,
                               const OutputOptions& output, const std::vector<FrameNumber>& frames);

/// Returns the fingerprint of one frame, of which `edits` is EditPrints::text().
std::string frame_fingerprint(const std::string& sequence, FrameNumber frame, const std::string& edits);

/// Name of the attribute of an .exr, and keyword of a .png, that holds the fingerprint.
inline constexpr const char* kFingerprintName = "halflightFingerprint";
/// Returns the comment of a .jpg, and description of a .tif, that holds a fingerprint. It is empty for an empty one.
std::string fingerprint_text(const std::string& fingerprint);

/// Returns the attribute of an .exr that holds a fingerprint. It counts pixels and channels, because other programs
/// keep attributes when they resize pictures or remove layers.
std::string fingerprint_of_exr(const std::string& fingerprint, int width, int height, std::size_t channels);

/// Returns the fingerprint in the header of an .exr; the text of the attribute if it does not fit the file.
std::string fingerprint_of(ExrFile& exr);

enum class FrameFile {
    missing,     // there is no such file
    whole,       // complete file with the expected fingerprint
    incomplete,  // picture that cannot be read to its end
    other,       // file without the expected fingerprint
};

/// Examines a picture, whose format is recognised by its contents. accepted: hashes of other sources whose pictures
/// count as those of this program. why: receives the differences() of a file that is another one.
FrameFile examine_frame(const std::filesystem::path& path, const std::string& fingerprint,
                        std::span<const std::string> accepted = {}, std::string* why = nullptr);

}  // namespace halflight
