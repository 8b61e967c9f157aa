// Sequences: frames of a scene as numbered files, and as a movie. Existing frames are kept.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "api/halflight/frame_renderer.h"
#include "api/halflight/loaded_scene.h"
#include "api/halflight/log.h"
#include "api/halflight/picture_file.h"
#include "engine/core/frames.h"

namespace halflight {

struct SequenceOptions {
    std::vector<FrameNumber> frames;             // frame numbers, in the order in which they are rendered
    ListPart part{};                             // part of `frames` to make, for work on several machines
    std::vector<std::filesystem::path> outputs;  // pictures with a placeholder (frame_names.h): "shot.####.exr"
    std::optional<std::filesystem::path> movie;  // movie of all frames, .mp4 or .mov; needs ffmpeg in PATH
    std::optional<std::filesystem::path> stats;  // file to which a line of JSON is appended per frame
    bool overwrite = false;                      // replaces frames that were made with other settings
    // Hashes of sources, as `halflight --version` prints them: frames that programs of these sources have made count as
    // those of this one. It is for the user to know that their pictures go together.
    std::vector<std::string> accept_sources{};
    // Renders nothing: all other pictures, and the movie, are developed from the .exr of each frame. Without it, that
    // happens to frames whose .exr is whole and holds the bits of the picture.
    bool develop = false;
    // Seconds between two saves of the samples of a frame, in a folder beside its first file; none: they are not saved.
    std::optional<double> checkpoint{};
    OutputOptions output{};
};

/// Callbacks of render_sequence(). All may be empty; they must not throw.
struct SequenceEvents {
    std::function<void(std::size_t frames)> started{};  // receives the number of frames to make
    std::function<bool(FrameNumber frame, const RenderProgress& progress)> progress{};  // false stops
    std::function<bool()>
        go_on{};  // called before each frame, in a pilot, and often while pages are loaded; false stops
    std::function<void(FrameNumber frame, std::size_t made, std::size_t failed)> made{};
    /// Called when another process has made a frame; `found`: number of such frames so far.
    std::function<void(FrameNumber frame, std::size_t found)> found{};
    std::function<void(FrameNumber frame, const std::string& error)> failed{};
    std::function<void(const std::function<void()>& write)> writing{};  // calls write(), which writes a frame's files
};

/// Counts of a rendered sequence.
struct SequenceTally {
    std::size_t frames = 0;  // number of frames of the part
    std::size_t kept = 0;    // number of frames whose files existed already
    std::size_t made = 0;    // number of frames rendered
    std::vector<FrameNumber> failed{};
    std::string reason{};                     // error message of the first failed frame
    std::optional<FrameNumber> stopped_in{};  // frame in which a callback stopped the sequence
};

/// Removes unfinished files of earlier runs. Throws Error for folders that cannot be written.
void check_outputs(const SequenceOptions& options);

/// Returns frames of the part with a file that is missing, damaged, or made from another scene or with other settings.
/// `look` is called before each frame, and may throw to stop.
std::vector<FrameNumber> incomplete_frames(
    const LoadedScene& scene, const RenderSettings& settings, const Shutter& shutter, const ColorConfig& colors,
    const SequenceOptions& options, const std::function<void()>& look = [] {});

/// Renders the missing frames of the part, and writes their files and the movie. Each frame is a function of scene,
/// frame number and settings, whichever run made it. Preview mode `temporal` is an exception and makes all frames
/// again. A frame that cannot be made does not stop the others. Throws Error at the end if frames have failed, and at
/// once for files that must not be replaced. A sequence that a callback stops leaves its finished frames and no
/// movie.
SequenceTally render_sequence(LoadedScene& scene, const RenderSettings& settings, const RendererOptions& renderer,
                              const SequenceOptions& options, const SequenceEvents& events = {}, const Log& log = {});

}  // namespace halflight
