// Statistics of pictures: as JSON, and as lines of text.
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "api/halflight/frame_renderer.h"
#include "engine/core/memory_ledger.h"
#include "engine/scene/scene.h"
#include "renderer/render_result.h"

namespace halflight {

/// Wall time of the steps around the renderer, seconds.
struct StepTimes {
    double context = 0;  // colour config and OpenGL context
    double load = 0;     // waiting for scene and environment
    double render = 0;   // FrameRenderer::render(): preparing, compiling, sampling, reading back
    double write = 0;    // writing of files
    double total = 0;    // time since the start
};

/// Returns the largest resident memory of the process so far, bytes.
std::uint64_t peak_memory_bytes();

/// Returns the memory budget, and what its parts hold, bytes.
nlohmann::ordered_json memory_json(const MemoryLedger& ledger);

/// Returns the name of the environment, with its radiance if it is constant; "none" if there is none.
std::string environment_name(const Environment& environment);

/// Returns "f/2.8, aperture 8.2 mm, focus at 1.5 m, 6 blades", the lens of a picture's camera; empty for a pinhole.
/// image: size of the whole picture, pixels.
std::string lens_text(const Camera& camera, const Lens& lens, const ivec2& image);

/// Returns the settings of the picture that `renderer` made last as one line, for the comments of its file.
std::string settings_line(const FrameRenderer& renderer, const RenderStats& stats);
/// Returns the end of settings_line() of a picture that is denoised with so many frames before and after it.
std::string denoised_text(int frames);

/// Returns "shadow gave 3 NaN, 1 infinite and 0 negative values" for each pass with bad values; empty without any.
std::string describe_bad_values(const RenderStats& stats);
/// Returns "relmse 0.0098, 0.0095 to 0.0101 at 95 %, target 0.01 reached".
std::string error_line(const AchievedError& error);
/// Returns "denoised picture: estimated relmse 0.0021, 0.0018 to 0.0024 at 95 %, from 16 other samples".
std::string error_line(const DenoisedError& error);

/// Returns statistics of the picture that `renderer` made last: scene, settings, device, times, passes, ray batches,
/// left-out parts (docs/speed.md). `outputs`: files of the picture.
nlohmann::ordered_json run_statistics(const FrameRenderer& renderer, const RenderStats& stats, const StepTimes& times,
                                      const std::vector<std::filesystem::path>& outputs);

}  // namespace halflight
