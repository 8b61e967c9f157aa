// Denoising as a step of its own: noisy frames in files (RenderSettings::keep_noisy) become pictures.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "api/halflight/log.h"
#include "api/halflight/picture_file.h"
#include "engine/color/color.h"
#include "engine/core/frames.h"
#include "engine/gpu/context.h"

namespace halflight {

struct DenoiseOptions {
    // Noisy frames, NAME.noisy.exr, or the pictures beside which they lie.
    std::vector<std::filesystem::path> frames;
    // Pictures: names with a placeholder for the frame number, or plain names for a single frame. Empty:
    // NAME.denoised.exr beside each noisy frame.
    std::vector<std::filesystem::path> outputs;
    std::optional<int>
        near{};  // number of frames before and after each frame that the denoiser uses; none: that of the files
    ViewTransform view{};  // view of outputs such as .png; an open exposure is that of the noisy frames
    OutputOptions output{};
    bool overwrite = false;                     // replaces pictures of other frames or settings
    std::vector<std::string> accept_sources{};  // SequenceOptions::accept_sources
    std::optional<ColorConfig> colors{};        // colour config; none: ColorConfig::load()
    gpu::ContextOptions device{};               // options for the context that is made
    std::shared_ptr<gpu::Context> context{};    // shared context; null: one is made
};

/// Counts of denoised frames.
struct DenoiseTally {
    std::size_t frames = 0;  // number of frames
    std::size_t kept = 0;    // number of frames whose pictures existed already
    std::size_t made = 0;
};

/// Denoises frames, in the order of their numbers. A frame takes light from frames before and after it, whose files
/// must be there. Pictures have the bits and the fingerprints of those that render_sequence() makes with `denoise` and
/// the same options. go_on: called before each frame with the number of frames that are done and of all; false stops.
/// Throws Error for a file that is missing, damaged or no noisy frame, for noisy frames of different scenes or
/// settings, and for pictures that must not be replaced.
DenoiseTally denoise_frames(const DenoiseOptions& options,
                            const std::function<bool(std::size_t done, std::size_t all)>& go_on = {},
                            const Log& log = {});

}  // namespace halflight
