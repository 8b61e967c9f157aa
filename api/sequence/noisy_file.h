// Files of noisy frames: .exr files of several parts, floats. They hold the noisy picture with its layers, and all that
// the denoiser reads, also for the frames near it.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "api/halflight/picture_file.h"
#include "engine/core/frames.h"
#include "renderer/noisy_frame.h"
#include "renderer/render_result.h"

namespace halflight {

/// A noisy frame with its picture.
struct NoisyPicture {
    RenderResult result;                      // the noisy picture with its layers; without times of passes
    std::unique_ptr<NoisyFrame> noisy{};      // needs the context
    PictureInfo info{};                       // what the picture's files say; without layout, fingerprints and colours
    std::string sums{};                       // sums_fingerprint(), with_edits() of the frame
    std::optional<float> metered_exposure{};  // exposure that metering found for an open one, stops
    int reach = 0;                            // number of frames before and after that motion leads to, at most
    // Names of the pictures of the frames to which it has motion, without folders and extensions, in their order.
    std::vector<std::string> near{};
};

/// Returns the name of the noisy frame beside a picture: "shot.0001.noisy.exr" for "shot.0001.png".
std::filesystem::path noisy_path(const std::filesystem::path& picture);
/// Returns the name of the noisy frame of a neighbour, which has no picture: "shot.0001.near.exr" for "shot.0001.png".
std::filesystem::path near_path(const std::filesystem::path& picture);
/// Returns the picture's name without its extension: "shot.0001" for "shot.0001.noisy.exr".
std::string name_of_noisy(const std::filesystem::path& noisy);

/// Returns whether a name is that of a noisy frame.
bool is_noisy_name(const std::filesystem::path& name);
/// Throws Error for an output with such a name, which would replace a noisy frame.
void check_not_noisy(const std::filesystem::path& output);

/// Returns the fingerprint of the file of a noisy frame.
std::string noisy_fingerprint(const std::string& sums, FrameNumber frame);

/// Writes a noisy frame, completely or not at all. Precondition: NoisyFrame::pixels. Throws Error.
void write_noisy_file(const std::filesystem::path& path, const NoisyPicture& picture, ExrCompression compression);

/// Reads a noisy frame. The context must be current. Throws Error for a file that is damaged or no noisy frame.
NoisyPicture read_noisy_file(const std::filesystem::path& path);

/// Description of a noisy frame without its pixels.
struct NoisyHeader {
    std::string sums{};  // NoisyPicture::sums
    FrameNumber frame = 0;
    bool of_sequence = false;         // the frame is one of a sequence, whose files have fingerprints
    int reach = 0;                    // NoisyPicture::reach
    std::vector<int> motion{};        // offsets of the frames to which it has motion: those of its neighbours
    std::vector<std::string> near{};  // NoisyPicture::near, by `motion`
};
/// Reads the header of a noisy frame, whose pixels may be damaged. Throws Error for a file that is no noisy frame.
NoisyHeader read_noisy_header(const std::filesystem::path& path);

}  // namespace halflight
